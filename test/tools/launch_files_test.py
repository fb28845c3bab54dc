#!/usr/bin/python3
"""The launch files pass roslaunch's own check, and every argument says what it is."""
import glob
import os
import sys
import unittest
from xml.etree import ElementTree

import roslaunch.rlutil
import rosunit

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "launch")
FILES = sorted(glob.glob(os.path.join(FOLDER, "*.launch")))


class LaunchFilesTest(unittest.TestCase):
    def test_there_are_launch_files(self):
        self.assertLessEqual({"bag.launch", "camera.launch", "demo.launch", "tracker.launch"},
                             {os.path.basename(f) for f in FILES})

    def test_roslaunch_finds_no_fault(self):
        for file in FILES:
            # Arguments without a default (bag:=) are the user's to give.
            self.assertIsNone(roslaunch.rlutil.check_roslaunch(file, ignore_unset_args=True), file)

    def test_every_argument_is_documented(self):
        for file in FILES:
            for arg in ElementTree.parse(file).getroot().findall("arg"):
                self.assertTrue(arg.get("doc"), f"{file}: {arg.get('name')}")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "launch_files", LaunchFilesTest, sysargs=sys.argv)
