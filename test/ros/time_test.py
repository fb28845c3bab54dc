#!/usr/bin/python3
"""Time as recordings and drivers have it: loops, jumps, pauses, stale and equal stamps."""
import os
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
from listening import Listener  # noqa: E402

FRAMES = 24


class TimeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("time_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)
        cls.tracker = feeding.Tracker("/tracker")
        cls.log = []
        cls.diagnostics = []
        cls.diagnostics_subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, cls.diagnostics.append)
        cls.log_subscriber = rospy.Subscriber("/rosout", Log, lambda m: cls.log.append(m.msg), queue_size=1000)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_1_a_bag_that_loops(self):
        """Each round is a recording of its own, however many of its images are dropped; it is said aloud."""
        rounds = 3
        player = subprocess.Popen(["rosbag", "play", "--loop", "--quiet", "--clock", "--wait-for-subscribers", "--bags",
                                   os.path.join(self.folder.name, "sequence.bag"), "--topics", "/camera/image_raw",
                                   "/camera/camera_info"], stdin=subprocess.DEVNULL)
        try:
            statuses = self.tracker.statuses
            self.assertTrue(self.tracker.wait_until(lambda: statuses and statuses[-1].epoch >= rounds))
            # The clock is behind the first round's end again and again: /diagnostics go on.
            before = len(self.diagnostics)
            self.assertTrue(self.tracker.wait_until(lambda: len(self.diagnostics) >= before + 2),
                            "no /diagnostics while the bag loops")
        finally:
            player.terminate()
            player.wait()
        first = [next(s for s in statuses if s.epoch == epoch) for epoch in range(1, rounds + 1)]
        begin = self.recording.images[0].header.stamp
        for status in first:
            self.assertEqual(status.reason, TrackerStatus.TIME_JUMP)
            self.assertIn("jumped back", status.reason_text)
            self.assertLess(status.header.stamp - begin, rospy.Duration(1))
        self.assertEqual(sum(s.reason == TrackerStatus.TIME_JUMP for s in statuses if s.epoch <= rounds), rounds)
        jumps = sum(s.reason == TrackerStatus.TIME_JUMP for s in statuses)
        self.assertEqual(statuses[-1].epoch, jumps, "nothing but the jumps makes a new map")
        self.assertGreaterEqual(sum("jumped back" in m for m in self.log), rounds)

    def show(self, image, seconds=0.0):
        return self.camera.show(feeding.moved(image, seconds), self.tracker)

    def test_2_a_pause_and_stale_stamps(self):
        TimeTest.camera = feeding.Camera("/camera", self.recording.info)
        images = self.recording.images
        self.assertTrue(self.tracker.call("reset").success)
        walk = (feeding.moved(image, 1000) for image in self.recording.walk())
        status = feeding.track(self.camera, self.tracker, walk, 15)[-1]
        epoch, last = status.epoch, status.header.stamp
        dropped, registered = status.frames_dropped, status.frames_posed

        newest = feeding.moved(images[0], 0)
        newest.data = next(i for i in self.recording.walk() if i.header.stamp + rospy.Duration(1000) == last).data
        newest.header.stamp = last
        equal = self.show(newest)
        self.assertEqual((equal.reason, equal.frames_dropped), (TrackerStatus.STALE_STAMP, dropped + 1))
        stale = self.show(newest, -0.05)
        self.assertEqual((stale.reason, stale.frames_dropped), (TrackerStatus.STALE_STAMP, dropped + 2))
        self.assertEqual((stale.state, stale.epoch, stale.frames_posed), (TrackerStatus.TRACKING, epoch, registered))
        self.assertIn("0.050 s", stale.reason_text)
        for _ in range(8):
            self.show(newest)
        self.assertTrue(self.tracker.wait_until(lambda: any("many images have a stamp" in m for m in self.log)),
                        "a clock that stands still is told")
        diagnostics = Listener("/diagnostics", DiagnosticArray)
        self.assertTrue(diagnostics.wait_for_number(2))
        told = {v.key: v.value for v in diagnostics.messages[-1].status[0].values}
        self.assertEqual((told["state"], told["frames dropped"]), ("TRACKING", str(dropped + 10)))
        self.assertNotEqual(told["reason"], "STALE_STAMP", "images left out say nothing of how tracking goes")

        odometry = Listener("/tracker/odometry", Odometry)
        feeding.wait_for_connections(odometry.subscriber)
        for pause in (600, 600.1):  # seconds
            again = self.show(newest, pause)
            self.assertEqual((again.state, again.epoch), (TrackerStatus.TRACKING, epoch), again.reason_text)
        self.expect_velocity(odometry, newest.header.stamp + rospy.Duration(600), False, "a mean of ten minutes")
        self.expect_velocity(odometry, again.header.stamp, True, "0.1 s later")
        blank = feeding.moved(newest, 600.2)
        blank.data = bytes(len(blank.data))
        self.assertEqual(self.camera.show(blank, self.tracker).state, TrackerStatus.LOST)
        found = feeding.track(self.camera, self.tracker, (feeding.moved(newest, 600.3 + 0.1 * i) for i in range(50)), 1)
        self.expect_velocity(odometry, found[-1].header.stamp, False, "it was lost between")
        back = self.show(newest, 1)
        self.assertEqual((back.reason, back.epoch), (TrackerStatus.TIME_JUMP, epoch + 1))
        self.assertIn("%.3f s" % (found[-1].header.stamp - back.header.stamp).to_sec(), back.reason_text)

    def expect_velocity(self, odometry, stamp, is_known, why):
        message = odometry.wait_for(lambda m: m.header.stamp == stamp)
        self.assertIsNotNone(message, why)
        variances = message.twist.covariance[::7]
        self.assertEqual((max(variances) < 1e3, min(variances) >= 1e6), (is_known, not is_known), why)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "time_test", TimeTest)
