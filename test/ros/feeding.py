"""For tests: a simulated recording, and trackers that are fed with it image by image, each answered before the next."""
import os
import subprocess
import sys
import threading
import time

import rosbag
import roslib.packages
import rospy
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import SLOWNESS, TIMEOUT  # noqa: E402


def read_tum(path):
    """{stamp in ns: (position, quaternion)}"""
    poses = {}
    with open(path) as lines:
        for line in lines:
            if line.startswith("#"):
                continue
            fields = line.split()
            if len(fields) != 8 or not line.endswith("\n"):
                raise AssertionError("%s: not a whole line: %s" % (path, line))
            values = [float(v) for v in fields[1:]]
            seconds, fraction = fields[0].split(".")
            poses[int(seconds) * 10**9 + int(fraction.ljust(9, "0"))] = (values[:3], values[3:])
    return poses


class Recording:
    """images and info: messages; truth: as read_tum gives it; masks: those messages by stamp in ns, with --bag-masks."""

    def __init__(self, folder, frames, *options, scene="room", width=320):
        simulate_sequence = roslib.packages.find_node("mono_pose_tracker", "simulate_sequence")[0]
        subprocess.run([simulate_sequence, "--scene", scene, "--output", folder, "--frames", str(frames),
                        "--width", str(width), "--height", str(width * 3 // 4), "--quiet", *options], check=True)
        self.camera_yaml = os.path.join(folder, "camera.yaml")
        self.truth = read_tum(os.path.join(folder, "groundtruth.txt"))
        with rosbag.Bag(os.path.join(folder, "sequence.bag")) as bag:
            messages = list(bag.read_messages())
        # rosbag's own classes have the fields, not the type, of the messages: publishers want the type.
        self.images = [as_type(Image, m.message) for m in messages if m.topic.endswith("image_raw")]
        self.info = next(as_type(CameraInfo, m.message) for m in messages if m.topic.endswith("camera_info"))
        self.masks = {m.message.header.stamp.to_nsec(): as_type(Image, m.message) for m in messages
                      if m.topic.endswith("mask")}

    def walk(self):
        """The images forth and back without end, at growing stamps; truth and masks come to know these."""
        truth = [self.truth[image.header.stamp.to_nsec()] for image in self.images]
        masks = [self.masks.get(image.header.stamp.to_nsec()) for image in self.images]
        period = (self.images[1].header.stamp - self.images[0].header.stamp).to_sec()
        last = len(self.images) - 1
        step = 0
        while True:
            i = last - abs(last - step % (2 * last)) if last else 0
            image = moved(self.images[i], period * (step - i))
            self.truth[image.header.stamp.to_nsec()] = truth[i]
            if masks[i] is not None:
                self.masks[image.header.stamp.to_nsec()] = moved(masks[i], period * (step - i))
            yield image
            step += 1


def as_type(kind, message):
    result = kind()
    for slot in kind.__slots__:
        setattr(result, slot, getattr(message, slot))
    return result


def moved(image, seconds):
    """The same image at a later time."""
    copy = Image(height=image.height, width=image.width, encoding=image.encoding, step=image.step, data=image.data,
                 is_bigendian=image.is_bigendian)
    copy.header.frame_id = image.header.frame_id
    copy.header.stamp = image.header.stamp + rospy.Duration(seconds)
    return copy


def wait_for_connections(*topics):
    """Of publishers and subscribers."""
    deadline = time.monotonic() + TIMEOUT
    while any(topic.get_num_connections() == 0 for topic in topics):
        if time.monotonic() > deadline:
            raise AssertionError("nobody at the other end of " + ", ".join(t.resolved_name for t in topics))
        time.sleep(0.02)


class Tracker:
    """What one tracker says."""

    def __init__(self, name):
        self.name = name
        self.changed = threading.Condition()
        self.statuses = []
        self.subscriber = rospy.Subscriber(name + "/status", TrackerStatus, self.on_status, queue_size=1000)
        wait_for_connections(self.subscriber)

    def on_status(self, status):
        with self.changed:
            self.statuses.append(status)
            self.changed.notify_all()

    def wait_until(self, condition, timeout=TIMEOUT):
        with self.changed:
            return self.changed.wait_for(condition, timeout)

    def answer_to(self, image, begin):
        """The first status from this one on that is of this image. An answer to an earlier image that comes late must
        not be taken for it: each image would then displace the one before, and none would be tracked."""
        stamp = image.header.stamp.to_nsec()  # not as the two fields: a careless driver's are put in order on the way

        def of_the_image():
            return next((s for s in self.statuses[begin:] if s.header.stamp.to_nsec() == stamp), None)

        if not self.wait_until(of_the_image):
            raise AssertionError(self.name + " did not answer an image")
        return of_the_image()

    def call(self, service):
        name = self.name + "/" + service
        rospy.wait_for_service(name, TIMEOUT)
        return rospy.ServiceProxy(name, Trigger)()


def track(camera, tracker, images, registered):
    """Shows images until so many have a pose: how long a map takes to begin hangs on how busy the machine is."""
    answers = []
    for image in images:
        answers.append(camera.show(image, tracker))
        if sum(a.state == TrackerStatus.TRACKING for a in answers) == registered:
            return answers
        if len(answers) > 500:
            raise AssertionError("tracked %d of %d images" % (answers[-1].frames_posed, len(answers)))


class Camera:
    """Publishes images and their calibration: each as soon as the one before is answered, or with `hz` no faster than a
    camera of that rate. Where no image may be lost that is needed: shown as fast as they are answered, what is seen
    turns further than the map reaches before a keyframe is mapped."""

    def __init__(self, namespace, info, hz=None, topic="image_raw"):
        self.period = 1 / hz if hz else 0  # s, of the wall
        self.due = time.monotonic()
        self.images = rospy.Publisher(namespace + "/" + topic, Image, queue_size=1000)
        self.infos = rospy.Publisher(namespace + "/camera_info", CameraInfo, queue_size=10)
        wait_for_connections(self.images, self.infos)
        self.set_calibration(info)

    def set_calibration(self, info):
        self.info = info

    def show(self, image, *trackers):
        """The trackers' answers to this image."""
        time.sleep(max(0, self.due - time.monotonic()))
        self.due = time.monotonic() + self.period
        before = [len(t.statuses) for t in trackers]
        if self.info is not None:
            self.info.header = image.header
            self.infos.publish(self.info)
        self.images.publish(image)
        answers = [tracker.answer_to(image, count) for tracker, count in zip(trackers, before)]
        return answers[0] if len(answers) == 1 else answers
