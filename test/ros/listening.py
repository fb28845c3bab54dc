"""What several rostests need: messages awaited, videos written, calibrations read."""
import os
import threading
import time

import cv2
import rospy
import yaml
from sensor_msgs.msg import CameraInfo

SLOWNESS = float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))  # of this build: with a sanitizer 10
TIMEOUT = 60 * SLOWNESS  # s; on a busy machine everything takes its time
VIDEO_FPS = 20.0


class Listener:
    """Collects the messages of a topic and lets a test wait for what it needs."""

    def __init__(self, topic, message_type):
        self.changed = threading.Condition()
        self.messages = []
        self.subscriber = rospy.Subscriber(topic, message_type, self.on_message, queue_size=1000)

    def on_message(self, message):
        with self.changed:
            self.messages.append(message)
            self.changed.notify_all()

    def wait_for(self, condition, start=0):
        """The first message that meets the condition, of those that came after `start` others, or still come; None
        after the timeout."""
        def found():
            return next((m for m in self.messages[start:] if condition(m)), None)
        with self.changed:
            self.changed.wait_for(lambda: found() is not None, TIMEOUT)
            return found()

    def wait_for_number(self, number):
        with self.changed:
            return self.changed.wait_for(lambda: len(self.messages) >= number, TIMEOUT)

    def wait_for_publisher(self):
        deadline = time.monotonic() + TIMEOUT
        while self.subscriber.get_num_connections() == 0:
            if time.monotonic() > deadline:
                raise AssertionError("nobody publishes " + self.subscriber.name)
            rospy.sleep(0.02)


def write_video(path, images):
    """In one step: nobody sees half of it."""
    partial = os.path.splitext(path)[0] + "_partial.avi"
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(partial, cv2.VideoWriter_fourcc(*"MJPG"), VIDEO_FPS, (width, height))
    for image in images:
        writer.write(image)
    writer.release()
    os.rename(partial, path)


def read_calibration(path):
    """CameraInfo of a file that camera_calibration or simulate_sequence wrote."""
    with open(path) as file:
        content = yaml.safe_load(file)
    info = CameraInfo(width=content["image_width"], height=content["image_height"],
                      distortion_model=content["distortion_model"])
    info.D = [float(v) for v in content["distortion_coefficients"]["data"]]
    info.K = [float(v) for v in content["camera_matrix"]["data"]]
    info.R = [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [*info.K[0:3], 0, *info.K[3:6], 0, *info.K[6:9], 0]
    return info


WIDTH, HEIGHT = 160, 120  # of the camera that camera_info describes


def camera_info(focal=200.0, width=WIDTH, height=HEIGHT):
    """Of a camera without distortion; focal 0: not calibrated."""
    info = CameraInfo(width=width, height=height, distortion_model="plumb_bob", D=[0.0] * 5)
    info.K = [focal, 0, width / 2, 0, focal, height / 2, 0, 0, 1 if focal else 0]
    info.P = [focal, 0, width / 2, 0, 0, focal, height / 2, 0, 0, 0, 1, 0]
    return info
