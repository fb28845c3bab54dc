#!/usr/bin/python3
"""A calibration that is missing, in a file, or that changes: what the node says of it, and what it does."""
import os
import sys
import time
import unittest

import numpy
import rospy
import rostest
from nodelet.srv import NodeletLoad
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
from listening import HEIGHT, WIDTH, Listener, camera_info  # noqa: E402


class NoisyCamera:
    """Sends no calibration until calibrate is called."""

    def __init__(self, namespace, tracker, topic="image_raw"):
        self.tracker = feeding.Tracker(tracker)
        self.camera = feeding.Camera(namespace, None, topic=topic)
        self.noise = numpy.random.RandomState(1)
        self.seconds = 1000.0

    def show(self):
        """The status that answers a new image."""
        self.seconds += 0.1
        data = self.noise.randint(0, 256, WIDTH * HEIGHT, dtype=numpy.uint8).tobytes()
        image = Image(width=WIDTH, height=HEIGHT, encoding="mono8", step=WIDTH, data=data)
        image.header.stamp = rospy.Time.from_sec(self.seconds)
        image.header.frame_id = "camera"
        return self.camera.show(image, self.tracker)

    def calibrate(self, focal, is_taken):
        """Sends it until an image's status shows that it is taken; that status."""
        self.camera.set_calibration(camera_info(focal))
        deadline = time.monotonic() + feeding.TIMEOUT
        while time.monotonic() < deadline:
            status = self.show()
            if is_taken(status):
                return status
        raise AssertionError("the calibration was not taken")


class CameraInfoTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("camera_info_test")
        cls.log = Listener("/rosout", Log)
        cls.camera = NoisyCamera("/camera", "/tracker")

    def heard(self, node, *words):
        return self.log.wait_for(lambda m: m.name == node and all(word in m.msg for word in words))

    def test_1_a_missing_calibration_is_named_with_what_to_do(self):
        said = None
        deadline = time.monotonic() + feeding.TIMEOUT
        while said is None and time.monotonic() < deadline:
            status = self.camera.show()  # images must go on: without them it is they that are missed
            self.assertEqual(status.reason_name, "NO_CAMERA_INFO", status.reason_text)
            said = next((m for m in list(self.log.messages)
                         if m.name == "/tracker" and "/camera/camera_info" in m.msg and "cameracalibrator" in m.msg), None)
        self.assertIsNotNone(said, "a warning names the topic and how to calibrate")
        self.assertEqual(said.level, Log.WARN)

    def test_2_a_changed_calibration_begins_a_new_epoch_and_is_said(self):
        first = self.camera.calibrate(200.0, lambda s: s.reason_name != "NO_CAMERA_INFO")
        self.assertEqual(first.state_name, "BOOTSTRAPPING", first.reason_text)
        second = self.camera.calibrate(250.0, lambda s: s.epoch > first.epoch)
        self.assertEqual(second.epoch, first.epoch + 1)
        self.assertIsNotNone(self.log.wait_for(
            lambda m: m.name == "/tracker" and m.level == Log.WARN and "the calibration has changed" in m.msg))
        self.assertIsNotNone(self.heard("/tracker", "the calibration has changed", "fx 200", "fx 250", "~camera_info_source"))
        self.assertEqual(second.reason_name, "CALIBRATION_CHANGED", second.reason_text)
        for word in ("fx 200", "fx 250", "~camera_info_source"):
            self.assertIn(word, second.reason_text)
        # 0.1 px at the corners of 160x120.
        varied = [self.camera.calibrate(250.0 + change, lambda s: True) for change in (0.2, -0.2, 0.1, 0)]
        self.assertEqual({s.epoch for s in varied}, {second.epoch}, "tenths of a pixel are tolerated")

    def test_3_the_file_serves_until_a_calibration_comes(self):
        camera = NoisyCamera("/uncalibrated_camera", "/tracker_with_file")
        status = camera.show()
        self.assertEqual(status.state_name, "BOOTSTRAPPING", status.reason_text)
        taken = camera.calibrate(250.0, lambda s: s.epoch > status.epoch)
        self.assertEqual(taken.state_name, "BOOTSTRAPPING", "camera_info wins over the file")

    def test_4_a_rectified_topic_is_not_undistorted_again(self):
        """By its name: P is used, and no distortion. Both trackers get the same calibration."""
        info = camera_info(200.0)
        info.D = [-0.3, 0.1, 0, 0, 0]
        for tracker, topic, rectified in (("/tracker_rectified", "image_rect_color", True),
                                          ("/tracker_told", "image_raw", True), ("/tracker_raw", "image_mono", False)):
            camera = NoisyCamera("/both_kinds", tracker, topic)
            camera.camera.set_calibration(info)
            status = camera.show()
            self.assertIs(status.rectified, rectified, tracker)
            self.assertIn("set to true" if topic == "image_raw" else topic, status.rectified_reason)

    def load(self, name, topic, **parameters):
        for key, value in parameters.items():
            rospy.set_param(f"{name}/{key}", value)
        rospy.wait_for_service("/manager/load_nodelet", feeding.TIMEOUT)
        load = rospy.ServiceProxy("/manager/load_nodelet", NodeletLoad)
        image = name.rpartition("/")[0] + "/image"
        self.assertTrue(load(name, "mono_pose_tracker/TrackerNodelet", [image], [topic], [], "").success)

    def test_5_the_console_names_the_choice_once(self):
        """With its reason; and a setting that the topic's name contradicts."""
        deadline = time.monotonic() + feeding.TIMEOUT
        while not any(m.name == "/manager" for m in list(self.log.messages)) and time.monotonic() < deadline:
            time.sleep(0.05)  # its first message shows that /rosout is connected
        info = camera_info(200.0)
        info.D = [-0.3, 0.1, 0, 0, 0]
        cases = (("/by_name/tracker", "/by_name/image_rect", "auto", "the images are treated as rectified: rectified is auto", None),
                 ("/against/tracker", "/against/image_raw", "true", "the images are treated as rectified: rectified is set to true",
                  "rectified is set to true, but /against/image_raw is a topic name of raw images"),
                 ("/as_raw/tracker", "/as_raw/image_rect", "false", "the images are treated as raw: rectified is set to false",
                  "rectified is set to false, but /as_raw/image_rect is a topic name of rectified images"))
        for name, topic, rectified, choice, contradiction in cases:
            start = len(self.log.messages)
            self.load(name, topic, rectified=rectified, publish_period=0.1)
            camera = NoisyCamera(topic.rpartition("/")[0], name, topic.rpartition("/")[2])
            camera.camera.set_calibration(info)
            for _ in range(5):
                camera.show()
            if contradiction:
                said = self.log.wait_for(lambda m: contradiction in m.msg, start)
                self.assertIsNotNone(said, name)
                self.assertEqual(said.level, Log.WARN)
            said = self.log.wait_for(lambda m: choice in m.msg, start)
            self.assertIsNotNone(said, name)
            self.assertEqual(said.level, Log.INFO)
            time.sleep(0.5)  # several publish_period
            said = [m.msg for m in self.log.messages[start:] if m.name == "/manager"]
            self.assertEqual(sum(choice in text for text in said), 1, said)
            self.assertEqual(sum("is a topic name of" in text for text in said), 1 if contradiction else 0, said)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "camera_info_test", CameraInfoTest)
