#!/usr/bin/python3
"""~save_map and ~load_map: a map is gone on with, and a file that can't be used leaves the running one alone."""
import os
import sys
import tempfile
import unittest

import rospy
import rostest
from sensor_msgs.msg import PointCloud2

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402

FRAMES = 20


class MapFileTest(unittest.TestCase):
    """One story: save, forget, load, damage."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("map_file_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)
        cls.tracker = feeding.Tracker("/tracker")
        cls.points = []
        cls.subscriber = rospy.Subscriber("/tracker/points", PointCloud2, cls.points.append)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def show(self, images, later):
        return [self.camera.show(feeding.moved(i, later), self.tracker) for i in images]

    def refused(self, *parts):
        """The loading of the map, and the running map goes on."""
        answer = self.tracker.call("load_map")
        self.assertFalse(answer.success)
        self.assertNotIn("\n", answer.message)
        for part in (self.path, *parts):
            self.assertIn(part, answer.message)
        MapFileTest.later += 10
        before = self.tracker.statuses[-1]
        after = self.show(self.recording.images[-1:], self.later)[0]
        self.assertEqual((after.epoch, after.state), (before.epoch, TrackerStatus.TRACKING))
        self.assertGreaterEqual(after.keyframes, before.keyframes)

    def test_the_story(self):
        before_calibration = self.tracker.call("load_map")
        self.assertFalse(before_calibration.success)
        self.assertIn("No such file", before_calibration.message, "the file is looked at at once")
        MapFileTest.camera = feeding.Camera("/camera", self.recording.info)
        nothing = self.tracker.call("save_map")
        self.assertFalse(nothing.success)
        self.assertIn("no map", nothing.message)

        statuses = feeding.track(self.camera, self.tracker, self.recording.walk(), 2 * FRAMES)
        saved = self.tracker.call("save_map")
        self.assertTrue(saved.success, saved.message)
        self.assertRegex(saved.message, r"^\d+ keyframes and \d+ landmarks in /.*\.map$")
        MapFileTest.path = saved.message.split(" in ")[1]
        self.addCleanup(os.remove, self.path)
        self.assertTrue(os.path.isfile(self.path))

        for parameter, service in (("map_path", "save_map"), ("save_trajectory_path", "save_trajectory")):
            name = "/tracker/" + parameter
            before = rospy.get_param(name, None)
            with tempfile.TemporaryDirectory() as folder:
                rospy.set_param(name, folder + "/elsewhere")
                answer = self.tracker.call(service)
                self.assertIn(" in " + folder + "/elsewhere", answer.message, "the path is read at each call")
                self.assertTrue(os.path.isfile(folder + "/elsewhere"))
            rospy.set_param(name, 7)
            self.assertIn("~" + parameter, self.tracker.call(service).message)
            rospy.delete_param(name) if before is None else rospy.set_param(name, before)

        self.assertTrue(self.tracker.call("reset").success)
        loaded = self.tracker.call("load_map")
        self.assertTrue(loaded.success, loaded.message)
        self.assertIn(self.path, loaded.message)
        self.assertEqual(loaded.message.split(" from ")[0], saved.message.split(" in ")[0])

        MapFileTest.later = 1000
        grey = feeding.moved(self.recording.images[0], 999)
        grey.data = bytes([128]) * len(grey.data)
        lost = self.camera.show(grey, self.tracker)
        self.assertEqual((lost.state, lost.reason), (TrackerStatus.LOST, TrackerStatus.RELOCALISING))
        self.assertEqual(lost.epoch, statuses[-1].epoch + 2, "after a reset, and a map that was loaded")
        again = self.show(self.recording.images, self.later)
        self.assertEqual(again[0].reason, TrackerStatus.RELOCALISING, "a second view has to agree")
        self.assertEqual({s.state for s in again[1:]}, {TrackerStatus.TRACKING}, "no new map has to be made")
        self.assertEqual({s.epoch for s in again}, {lost.epoch})

        self.damage()

    def damage(self):
        with open(self.path, "rb") as file:
            content = file.read()
        for damaged, word in ((content[:len(content) // 2], "truncated"), (b"", "not a map file"),
                              (content[:8] + b"\x09" + content[9:], "version 9"),
                              (content[:-1000] + bytes([content[-1000] ^ 1]) + content[-999:], "damaged")):
            with open(self.path, "wb") as file:
                file.write(damaged)
            self.refused(word)
        self.assertTrue(self.tracker.call("save_map").success)
        self.camera.info.K = [k * 1.5 for k in self.camera.info.K[:8]] + [1]
        MapFileTest.later += 10
        self.show(self.recording.images[:1], self.later)
        answer = self.tracker.call("load_map")
        self.assertTrue(answer.success, "another camera may go on in it: " + answer.message)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "map_file_test", MapFileTest)
