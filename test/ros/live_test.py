#!/usr/bin/python3
"""What a user sees and can do while the tracker runs: diagnostics, status, live parameters."""
import glob
import os
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy
import roslib.packages
import rospy
import rostest
from cv_bridge import CvBridge
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import CameraInfo, Image

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import Listener, read_calibration  # noqa: E402

FRAMES = 48


def dynparam(*arguments):
    program = roslib.packages.find_node("dynamic_reconfigure", "dynparam")[0]
    # By this interpreter: another python3 may come first on PATH.
    result = subprocess.run([sys.executable, program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True, timeout=60)
    assert result.returncode == 0, result.stdout
    return result.stdout


class LiveTest(unittest.TestCase):
    """One after the other, as their names say: each goes on where the one before ended."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("live_test")
        cls.diagnostics = Listener("/diagnostics", DiagnosticArray)
        cls.statuses = Listener("tracker/status", TrackerStatus)
        cls.images = rospy.Publisher("camera/image_raw", Image, queue_size=10)
        cls.infos = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=10)
        cls.bridge = CvBridge()
        cls.seconds = 1000.0
        cls.position = 0  # in the recording
        with tempfile.TemporaryDirectory() as folder:
            simulate_sequence = roslib.packages.find_node("mono_pose_tracker", "simulate_sequence")[0]
            subprocess.run([simulate_sequence, "--scene", "room", "--output", folder, "--frames", str(FRAMES), "--width",
                            "320", "--height", "240", "--samples", "1", "--quiet"], check=True)
            cls.recording = [cv2.imread(f) for f in sorted(glob.glob(folder + "/images/*"))]
            cls.calibration = read_calibration(folder + "/camera.yaml")
        for connection in (cls.images, cls.infos, cls.statuses.subscriber, cls.diagnostics.subscriber):
            while connection.get_num_connections() == 0 and not rospy.is_shutdown():
                rospy.sleep(0.02)

    def show(self, image):
        """The status that answers the image."""
        LiveTest.seconds += 0.1
        message = self.bridge.cv2_to_imgmsg(image, "bgr8")
        message.header.stamp = rospy.Time.from_sec(self.seconds)
        message.header.frame_id = "camera"
        self.images.publish(message)
        status = self.statuses.wait_for(lambda s: s.header.stamp == message.header.stamp)
        self.assertIsNotNone(status, "every image is answered")
        return status

    def walk(self, steps):
        """Shows as many images of the recording, forward to its end, back to its beginning, and so on; the last status."""
        for _ in range(steps):
            LiveTest.position += 1
            back_and_forth = self.recording + self.recording[-2:0:-1]
            status = self.show(back_and_forth[self.position % len(back_and_forth)])
        return status

    def calibrate(self, info, is_taken):
        """Sends it until an image's status shows that it is taken."""
        for _ in range(100):
            self.infos.publish(info)
            if is_taken(self.show(self.recording[0])):
                return
            rospy.sleep(0.05)
        self.fail("the calibration never arrived")

    def diagnosis(self, condition):
        """The next status on /diagnostics that meets the condition, with its values."""
        def tracker(array):
            return next((s for s in array.status if s.name == "tracker: tracker" and condition(s)), None)
        array = self.diagnostics.wait_for(tracker, start=len(self.diagnostics.messages))
        self.assertIsNotNone(array, "it was never said on /diagnostics")
        return tracker(array), {v.key: v.value for v in tracker(array).values}

    def test_1_not_calibrated_is_an_error(self):
        blank = CameraInfo(width=320, height=240, distortion_model="plumb_bob")
        self.calibrate(blank, lambda s: s.reason == TrackerStatus.UNCALIBRATED)
        status, values = self.diagnosis(lambda s: s.level == DiagnosticStatus.ERROR and "UNCALIBRATED" in s.message)
        self.assertIn("cameracalibrator", status.message)
        self.assertEqual(values["calibration"], "none")

    def test_2_starting_is_a_warning(self):
        self.calibrate(self.calibration, lambda s: s.state == TrackerStatus.BOOTSTRAPPING)
        status, _ = self.diagnosis(lambda s: s.level == DiagnosticStatus.WARN)
        self.assertIn("BOOTSTRAPPING", status.message)

    def test_3_tracking_is_ok(self):
        # The first map is made beside the images, as fast as the machine can.
        for _ in range(500):
            if self.walk(1).state == TrackerStatus.TRACKING:
                break
        status = self.walk(5)
        self.assertEqual(status.state, TrackerStatus.TRACKING)
        _, values = self.diagnosis(lambda s: s.level == DiagnosticStatus.OK and "TRACKING" in s.message)
        self.assertIn("320x240", values["calibration"])
        self.assertIn("/camera/camera_info", values["calibration"])
        self.assertEqual(int(values["inliers"]), status.inliers)
        for key in ("frame rate (Hz)", "latency (ms)", "reprojection rms (px)", "keyframes", "landmarks"):
            self.assertGreater(float(values[key]), 0, key)
        for key in ("frames dropped", "worker backlog"):
            self.assertGreaterEqual(int(values[key]), 0, key)

    def test_4_the_status_is_complete(self):
        status = self.statuses.messages[-1]
        self.assertEqual((status.state_name, status.reason_name), ("TRACKING", "OK"))
        for field in ("features", "matches", "inliers", "median_parallax_deg", "reprojection_rms_px", "keyframes",
                      "landmarks", "latency_ms", "frames_received", "frames_posed"):
            self.assertGreater(getattr(status, field), 0, field)
        self.assertEqual(len(status.stage_names), len(status.stage_ms))
        self.assertLessEqual({"features", "resect"}, set(status.stage_names))
        stages = dict(zip(status.stage_names, status.stage_ms))  # the mapper's own are beside the image's way
        self.assertLessEqual(stages["features"] + stages["resect"], status.latency_ms)
        self.assertLess(status.reprojection_rms_px, 2)

    def test_5_parameters_change_while_it_tracks(self):
        before = self.walk(1)
        self.assertGreater(before.features, 400)
        dynparam("set", "/tracker", "sift/max_features", "300")
        after = self.walk(1)
        self.assertLessEqual(after.features, 300)
        self.assertEqual((after.state, after.epoch), (TrackerStatus.TRACKING, before.epoch))
        self.assertEqual(rospy.get_param("/tracker/sift/max_features"), 300)
        # Out of range: the nearest that is in range.
        dynparam("set", "/tracker", "{sift/contrast_threshold: 7, publish_period: 0.25}")
        self.assertEqual(rospy.get_param("/tracker/sift/contrast_threshold"), 1)
        self.assertEqual(rospy.get_param("/tracker/publish_period"), 0.25)
        self.assertEqual(self.walk(1).features, 0)
        dynparam("set", "/tracker", "{sift/max_features: 900, sift/contrast_threshold: 0.03}")
        back = self.walk(3)
        self.assertGreater(back.features, 400)
        self.assertEqual((back.state, back.epoch), (TrackerStatus.TRACKING, before.epoch))

    def test_6_lost_is_a_warning(self):
        noise = numpy.random.RandomState(1).randint(0, 256, (240, 320, 3), dtype=numpy.uint8)
        self.assertEqual(self.show(noise).state, TrackerStatus.LOST)
        status, _ = self.diagnosis(lambda s: s.level == DiagnosticStatus.WARN)
        self.assertIn("LOST", status.message)
        self.assertEqual(self.walk(1).state, TrackerStatus.TRACKING)
        self.diagnosis(lambda s: s.level == DiagnosticStatus.OK)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "live_test", LiveTest)
