#!/usr/bin/python3
"""Services while images come, a node that is killed, and one that is unloaded in the middle of it all."""
import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy
import roslib.packages
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
from background import Background, Stream  # noqa: E402
from listening import Listener  # noqa: E402
from transforms import stamped  # noqa: E402

FRAMES = 24


class Answers:
    """Of a service, from several threads."""

    def __init__(self):
        self.all, self.changed = [], threading.Condition()

    def add(self, answer):
        with self.changed:
            self.all.append((answer.success, answer.message))
            self.changed.notify_all()

    def wait_for_number(self, number):
        with self.changed:
            return self.changed.wait_for(lambda: len(self.all) >= number, feeding.TIMEOUT)


class ServicesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("services_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def start(self, name, *arguments):
        program = roslib.packages.find_node("mono_pose_tracker", "tracker_node")[0]
        node = subprocess.Popen([program, "__name:=" + name, "image:=/" + name + "_camera/image_raw", *arguments],
                                cwd=self.folder.name)
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        tracker = feeding.Tracker("/" + name)
        return node, tracker, feeding.Camera("/" + name + "_camera", self.recording.info)

    def test_the_trajectory_survives_kill(self):
        node, tracker, camera = self.start("killed", "_trajectory_file:=growing.txt")  # relative to the working folder
        registered = [s for s in feeding.track(camera, tracker, self.recording.walk(), 15)
                 if s.state == TrackerStatus.TRACKING]
        node.send_signal(signal.SIGKILL)
        node.wait()
        trajectory = feeding.read_tum(os.path.join(self.folder.name, "growing.txt"))
        # The status leaves before its line is written: the last one may be missing.
        stamps = {s.header.stamp.to_nsec() for s in registered}
        self.assertLessEqual(stamps - set(trajectory), {registered[-1].header.stamp.to_nsec()})
        self.assertLessEqual(set(trajectory), stamps)

    def test_what_is_saved_does_not_end_the_growing_trajectory(self):
        """The same file by other names: a whole one would be renamed over it, and later poses go nowhere."""
        by_another_name = os.path.join(self.folder.name, "..", os.path.basename(self.folder.name), "both.txt")
        _, tracker, camera = self.start("saving", "_trajectory_file:=both.txt", "_save_trajectory_path:=" + by_another_name)
        images = self.recording.walk()
        feeding.track(camera, tracker, images, 5)
        os.symlink("both.txt", os.path.join(self.folder.name, "link.map"))
        rospy.set_param("/saving/map_path", os.path.join(self.folder.name, "link.map"))
        for service, parameter in (("save_trajectory", "save_trajectory_path"), ("save_map", "map_path")):
            refused = tracker.call(service)
            self.assertFalse(refused.success, refused.message)
            self.assertIn("~%s and ~trajectory_file are the same file" % parameter, refused.message)
        registered = [s.header.stamp.to_nsec() for s in feeding.track(camera, tracker, images, 5)]
        self.assertTrue(tracker.wait_until(lambda: registered[-2] in feeding.read_tum(self.folder.name + "/both.txt")))

    def test_relative_paths_and_tilde(self):
        _, tracker, camera = self.start("paths", "_save_trajectory_path:=saved.txt", "_map_path:=~/no_such_folder/a.map")
        feeding.track(camera, tracker, self.recording.walk(), 5)
        saved = tracker.call("save_trajectory")
        self.assertTrue(saved.success)
        path = os.path.join(os.path.realpath(self.folder.name), "saved.txt")
        self.assertTrue(saved.message.endswith(" poses in " + path), saved.message)
        self.assertEqual(len(feeding.read_tum(path)), int(saved.message.split()[0]))
        refused = tracker.call("save_map")
        self.assertFalse(refused.success)
        self.assertIn(os.path.expanduser("~/no_such_folder/a.map"), refused.message)

    def test_the_trajectory_is_dropped_with_its_map(self):
        """At once, not with the next image, which may be long in coming. The file that was saved before stays."""
        path = os.path.join(self.folder.name, "dropped.txt")
        _, tracker, camera = self.start("dropping", "_save_trajectory_path:=dropped.txt", "_map_path:=dropped.map")
        images = self.recording.walk()
        for service in ("reset", "load_map"):
            feeding.track(camera, tracker, images, 5)
            self.assertTrue(tracker.call("save_map").success)
            self.assertGreaterEqual(int(tracker.call("save_trajectory").message.split()[0]), 5)
            self.assertTrue(tracker.call(service).success)
            kept = feeding.read_tum(path)
            refused = tracker.call("save_trajectory")
            self.assertFalse(refused.success, refused.message)
            self.assertIn("there is no pose yet", refused.message)
            self.assertEqual(feeding.read_tum(path), kept)

    def test_a_map_that_is_gone_leaves_no_scale_behind(self):
        """In the status of an image that nobody has looked at since."""
        _, tracker, camera = self.start("scaled", "_map_path:=scaled.map", "_scale/initial_median_depth:=2.0")
        images = self.recording.walk()
        for service in ("reset", "load_map"):
            registered = feeding.track(camera, tracker, images, 5)[-1]
            self.assertEqual(registered.scale_name, "INITIAL_MEDIAN_DEPTH")
            for command in ("save_map", service, "pause"):
                answer = tracker.call(command)
                self.assertTrue(answer.success, answer.message)
            paused = camera.show(next(images), tracker)
            self.assertEqual((paused.state, paused.map_id), (TrackerStatus.PAUSED, 0))
            self.assertEqual((paused.scale, paused.scale_name), (TrackerStatus.MAP_UNITS, "MAP_UNITS"), service)
            self.assertTrue(tracker.call("resume").success)

    def test_tf_and_frustum_go_with_their_map(self):
        _, tracker, camera = self.start("taken", "_map_path:=taken.map", "_camera_frame:=taken_camera",
                                        "_map_frame:=taken_map", "_odom_frame:=taken_odom",
                                        "_scale/initial_median_depth:=1.0")
        static = tf2_ros.StaticTransformBroadcaster()
        feeding.wait_for_connections(static.pub_tf)
        static.sendTransform([stamped("taken_odom", "taken_camera", rospy.Time.now(), (0, 0, 0), (0, 0, 0, 1))])
        frusta, diagnostics = Listener("/taken/camera_frustum", Marker), Listener("/diagnostics", DiagnosticArray)
        transforms = Listener("/tf", TFMessage)
        images = self.recording.walk()
        is_odom = lambda m: m.transforms[0].child_frame_id == "taken_odom"  # noqa: E731
        for service in ("reset", "load_map"):
            before, sent = len(frusta.messages), len(transforms.messages)
            while not any(m.action == Marker.ADD for m in frusta.messages[before:]):
                feeding.track(camera, tracker, images, 5)
            self.assertIsNotNone(transforms.wait_for(is_odom, sent))
            self.assertTrue(tracker.call("save_map").success)
            drawn = len(frusta.messages)
            self.assertTrue(tracker.call(service).success)
            self.assertIsNotNone(frusta.wait_for(lambda m: m.action == Marker.DELETE, drawn), service)
            # Told once a second; map -> odom was sent twenty times in it.
            self.assertTrue(diagnostics.wait_for_number(len(diagnostics.messages) + 1))
            sent = len(transforms.messages)
            self.assertTrue(diagnostics.wait_for_number(len(diagnostics.messages) + 1))
            self.assertFalse([m for m in transforms.messages[sent:] if is_odom(m)], service)

    def test_withdrawn_poses_leave_the_trajectory(self):
        """With few visible landmarks (a hole in the lower right corner) poses are doubtful, and the third in a row is
        rejected. The hole's size depends on the map, which differs between runs."""
        _, tracker, camera = self.start("doubting", "_save_trajectory_path:=doubting.txt")
        images = self.recording.walk()
        feeding.track(camera, tracker, images, 15)
        for width in 20 * list(range(60, 75, 3)):
            before = feeding.track(camera, tracker, images, 6)[-1].header.stamp
            shown = next(i for i in self.recording.walk() if i.header.stamp == before)
            doubtful = []
            for i in range(1, 4):
                answer = camera.show(self.through_a_hole(feeding.moved(shown, 1e-3 * i), width), tracker)
                if answer.reason != TrackerStatus.DOUBTFUL_POSE:
                    break
                doubtful.append(answer.header.stamp.to_nsec())
            if "several doubtful poses in a row" in answer.reason_text:
                break
        self.assertIn("several doubtful poses in a row", answer.reason_text)
        self.assertEqual(len(doubtful), 2)
        saved = tracker.call("save_trajectory")
        self.assertTrue(saved.success, saved.message)
        trajectory = feeding.read_tum(os.path.join(self.folder.name, "doubting.txt"))
        self.assertIn(before.to_nsec(), trajectory)
        self.assertFalse(set(doubtful) & set(trajectory))

    @staticmethod
    def through_a_hole(image, width):
        """In a wall full of spots: they show where there would have been something to see."""
        pixels = numpy.frombuffer(image.data, numpy.uint8).reshape(image.height, image.width, -1)
        spots = numpy.random.RandomState(1).randint(0, 256, (image.height // 8, image.width // 8, 1), numpy.uint8)
        covered = numpy.zeros_like(pixels) + spots.repeat(8, 0).repeat(8, 1)
        hole = slice(image.height - width * 3 // 4, None), slice(image.width - width, None)
        covered[hole] = pixels[hole]
        image.data = covered.tobytes()
        return image

    def test_200_resets_under_load(self):
        _, tracker, camera = self.start("resets")
        stream = Stream(camera, self.recording.images)
        self.addCleanup(stream.stop)
        self.assertTrue(tracker.wait_until(lambda: tracker.statuses))
        rospy.wait_for_service("/resets/reset", feeding.TIMEOUT)
        reset = rospy.ServiceProxy("/resets/reset", Trigger)
        for _ in range(200):
            self.assertTrue(reset().success)
        stream.stop()
        self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) == stream.sent), "every image is answered")
        epochs = [s.epoch for s in tracker.statuses if s.reason != TrackerStatus.DROPPED]
        self.assertEqual(epochs, sorted(epochs))
        last = feeding.moved(self.recording.images[0], 1e5)
        self.assertGreaterEqual(camera.show(last, tracker).epoch, 200)

    def test_unloaded_while_services_wait(self):
        """The manager lives on; who called is answered, or told that nobody is there any more."""
        nodelet = roslib.packages.find_node("nodelet", "nodelet")[0]
        camera = None
        for i in range(5):
            # Names of their own: the bond of one that is gone may take its successor with it.
            name = "unloaded_%d" % i
            loader = subprocess.Popen([nodelet, "load", "mono_pose_tracker/TrackerNodelet", "/manager",
                                       "__name:=" + name, "image:=/unloaded_camera/image_raw"])
            self.addCleanup(loader.kill)
            camera = camera or feeding.Camera("/unloaded_camera", self.recording.info)
            feeding.wait_for_connections(camera.images)
            stream = Stream(camera, self.recording.images)
            self.addCleanup(stream.stop)
            answers = Answers()
            callers = [Background(self.call_until_gone, name, answers) for _ in range(2)]
            self.assertTrue(answers.wait_for_number(10), "the services answer while images come")
            loader.send_signal(signal.SIGINT)  # it unloads the nodelet
            loader.wait(feeding.TIMEOUT)
            for caller in callers:
                caller.join()
            stream.stop()
            for success, message in answers.all:
                self.assertTrue(success or message == "the tracker is shutting down", message)

    @staticmethod
    def call_until_gone(name, answers):
        reset = rospy.ServiceProxy("/" + name + "/reset", Trigger)
        reset.wait_for_service(feeding.TIMEOUT)
        try:
            while True:
                answer = reset()
                answers.add(answer)
        except rospy.ServiceException:
            pass


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "services_test", ServicesTest)
