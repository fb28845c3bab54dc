#!/usr/bin/python3
"""What a user sees and can do while the tracker runs: diagnostics, status, live parameters."""
import os
import subprocess
import sys
import unittest

import numpy
import roslib.packages
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Path
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import Listener  # noqa: E402
from simulated_camera import SimulatedCamera  # noqa: E402


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
        cls.camera = SimulatedCamera("room", 48)
        while cls.diagnostics.subscriber.get_num_connections() == 0 and not rospy.is_shutdown():
            rospy.sleep(0.02)

    def diagnosis(self, condition):
        """The next status on /diagnostics that meets the condition, with its values."""
        def tracker(array):
            return next((s for s in array.status if s.name == "tracker: tracker" and condition(s)), None)
        array = self.diagnostics.wait_for(tracker, start=len(self.diagnostics.messages))
        self.assertIsNotNone(array, "it was never said on /diagnostics")
        return tracker(array), {v.key: v.value for v in tracker(array).values}

    def test_1_not_calibrated_is_an_error(self):
        blank = CameraInfo(width=320, height=240, distortion_model="plumb_bob")
        self.camera.calibrate(blank, lambda s: s.reason == TrackerStatus.UNCALIBRATED)
        status, values = self.diagnosis(lambda s: s.level == DiagnosticStatus.ERROR and "UNCALIBRATED" in s.message)
        self.assertIn("cameracalibrator", status.message)
        self.assertEqual(values["calibration"], "none")

    def test_2_starting_is_a_warning(self):
        self.camera.calibrate(self.camera.calibration, lambda s: s.state == TrackerStatus.BOOTSTRAPPING)
        status, _ = self.diagnosis(lambda s: s.level == DiagnosticStatus.WARN)
        self.assertIn("BOOTSTRAPPING", status.message)

    def test_3_tracking_is_ok(self):
        self.camera.walk_until_tracked()
        status = self.camera.walk(5)
        self.assertEqual(status.state, TrackerStatus.TRACKING)
        # Those of the last image; earlier ones may still be on their way.
        inliers = str(status.inliers)
        _, values = self.diagnosis(lambda s: s.level == DiagnosticStatus.OK and "TRACKING" in s.message
                                   and inliers in [pair.value for pair in s.values if pair.key == "inliers"])
        self.assertIn("320x240", values["calibration"])
        self.assertIn("/camera/camera_info", values["calibration"])
        for key in ("frame rate (Hz)", "latency (ms)", "reprojection rms (px)", "keyframes", "landmarks"):
            self.assertGreater(float(values[key]), 0, key)
        for key in ("frames dropped", "worker backlog"):
            self.assertGreaterEqual(int(values[key]), 0, key)

    def test_4_the_status_is_complete(self):
        status = self.camera.statuses.messages[-1]
        self.assertEqual((status.state_name, status.reason_name), ("TRACKING", "OK"))
        for field in ("features", "matches", "inliers", "median_parallax_deg", "reprojection_rms_px", "keyframes",
                      "landmarks", "latency_ms", "frames_received", "frames_posed"):
            self.assertGreater(getattr(status, field), 0, field)
        self.assertEqual(len(status.stage_names), len(status.stage_ms))
        self.assertLessEqual({"features", "resect"}, set(status.stage_names))
        stages = dict(zip(status.stage_names, status.stage_ms))  # the mapper's own are beside the image's way
        self.assertLessEqual(stages["features"] + stages["resect"], status.latency_ms)
        self.assertLess(status.reprojection_rms_px, 2)

    def test_4_the_debug_image_shows_the_features(self):
        drawn = Listener("tracker/debug_image", Image)
        drawn.wait_for_publisher()
        # A moment later the node knows as well that somebody listens.
        for _ in range(50):
            status = self.camera.walk(1)
            if drawn.messages:
                break
        status = self.camera.walk(1)
        image = drawn.wait_for(lambda m: m.header.stamp == status.header.stamp)
        self.assertIsNotNone(image, "with the image's stamp")
        blue, green, red = numpy.moveaxis(self.camera.bridge.imgmsg_to_cv2(image, "bgr8").astype(int), 2, 0)
        in_green = numpy.count_nonzero((green > blue + 60) & (green > red + 60))
        self.assertGreater(in_green, 2 * status.inliers, "dots of some pixels each")
        drawn.subscriber.unregister()

    def first_heard(self, topic, message_type):
        """Of one who comes late, and no image comes any more."""
        listener = Listener("tracker/" + topic, message_type)
        self.addCleanup(listener.subscriber.unregister)
        self.assertTrue(listener.wait_for_number(1), topic + " is given to who comes late")
        return listener.messages[0]

    def walk_until_settled(self):
        """The last two images were registered in the present map: no landmark is being culled."""
        settled = 0
        for _ in range(200):
            status = self.camera.walk(1)
            settled = settled + 1 if status.worker_backlog == 0 else 0
            if settled > 1:
                return status
        raise AssertionError("the mapper is never done")

    def test_4_who_comes_late_hears_it_all_as_it_is_now(self):
        """Nobody listened before, then somebody who has left: neither is what came late to be told from."""
        for _ in range(2):
            status = self.walk_until_settled()
            registered = [s.header.stamp for s in self.camera.statuses.messages
                     if s.state == TrackerStatus.TRACKING and s.epoch == status.epoch]
            for _ in range(2):  # the second while the first still listens
                path = self.first_heard("path", Path)
                self.assertEqual([p.header.stamp for p in path.poses], registered)
                self.assertEqual(path.header.stamp, status.header.stamp)
                self.assertEqual(path._connection_header["latching"], "1")
                positions = self.first_heard("camera_positions", PointCloud2)
                self.assertEqual((positions.width, positions.header.stamp), (len(registered), status.header.stamp))
                points = self.first_heard("points", PointCloud2)
                self.assertGreater(points.width, status.inliers)
                self.assertEqual(points.header.stamp, status.header.stamp)
                self.assertGreater(len(self.first_heard("keyframes", MarkerArray).markers[0].points), 0)
            self.doCleanups()

    def test_5_parameters_change_while_it_tracks(self):
        before = self.camera.walk(1)
        self.assertGreater(before.features, 400)
        dynparam("set", "/tracker", "sift/max_features", "300")
        after = self.camera.walk(1)
        self.assertLessEqual(after.features, 300)
        self.assertEqual((after.state, after.epoch), (TrackerStatus.TRACKING, before.epoch))
        self.assertEqual(rospy.get_param("/tracker/sift/max_features"), 300)
        # Out of range: the nearest that is in range.
        dynparam("set", "/tracker", "{sift/contrast_threshold: 7, publish_period: 0.25}")
        self.assertEqual(rospy.get_param("/tracker/sift/contrast_threshold"), 1)
        self.assertEqual(rospy.get_param("/tracker/publish_period"), 0.25)
        self.assertEqual(self.camera.walk(1).features, 0)
        dynparam("set", "/tracker", "{sift/max_features: 900, sift/contrast_threshold: 0.03}")
        back = self.camera.walk(3)
        self.assertGreater(back.features, 400)
        self.assertEqual((back.state, back.epoch), (TrackerStatus.TRACKING, before.epoch))

    def test_6_lost_is_a_warning(self):
        noise = numpy.random.RandomState(1).randint(0, 256, (240, 320, 3), dtype=numpy.uint8)
        self.assertEqual(self.camera.show(noise).state, TrackerStatus.LOST)
        status, _ = self.diagnosis(lambda s: s.level == DiagnosticStatus.WARN)
        self.assertIn("LOST", status.message)
        held_back = self.camera.walk(1)
        self.assertEqual((held_back.state, held_back.reason), (TrackerStatus.LOST, TrackerStatus.RELOCALISING),
                         "a second view has to agree")
        self.assertEqual(self.camera.walk(1).state, TrackerStatus.TRACKING)
        self.diagnosis(lambda s: s.level == DiagnosticStatus.OK)

    def test_7_of_a_map_that_is_gone_nobody_is_told(self):
        self.assertGreater(len(self.first_heard("path", Path).poses), 0)
        self.doCleanups()
        self.assertTrue(rospy.ServiceProxy("tracker/reset", Trigger)().success)
        status = self.camera.walk(1)
        self.assertEqual(status.state, TrackerStatus.BOOTSTRAPPING)
        self.assertEqual(self.first_heard("path", Path).poses, [])
        self.assertEqual(self.first_heard("camera_positions", PointCloud2).width, 0)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "live_test", LiveTest)
