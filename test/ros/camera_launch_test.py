#!/usr/bin/python3
"""A user's first hour with a camera: plugged in late, not calibrated, calibrated, tracked."""
import glob
import os
import subprocess
import sys
import tempfile
import unittest
import urllib.parse

import cv2
import roslib.packages
import rospy
import rostest
from sensor_msgs.srv import SetCameraInfo

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import Listener, VIDEO_FPS, read_calibration  # noqa: E402
from mjpeg_stream import MjpegStream  # noqa: E402


class CameraLaunchTest(unittest.TestCase):
    def test_from_unplugged_to_tracked(self):
        rospy.init_node("camera_launch_test")
        statuses = Listener("tracker/status", TrackerStatus)
        stored = rospy.get_param("camera/camera_info_url")[len("file://"):]
        self.addCleanup(lambda: os.path.exists(stored) and os.remove(stored))
        self.assertEqual(len(statuses.messages), 0)
        with tempfile.TemporaryDirectory() as folder:
            simulate_sequence = roslib.packages.find_node("mono_pose_tracker", "simulate_sequence")[0]
            subprocess.run([simulate_sequence, "--scene", "room", "--output", folder, "--frames", "40", "--width", "320",
                            "--height", "240", "--samples", "1", "--quiet"], check=True)
            images = [cv2.imread(f) for f in sorted(glob.glob(folder + "/images/*"))]
            calibration = read_calibration(folder + "/camera.yaml")
        port = urllib.parse.urlparse(rospy.get_param("camera/device")).port
        self.addCleanup(MjpegStream(port, images, VIDEO_FPS).close)
        self.assertIsNotNone(statuses.wait_for(lambda s: s.reason == TrackerStatus.UNCALIBRATED))
        self.assertTrue(rospy.ServiceProxy("camera/set_camera_info", SetCameraInfo)(calibration).success)
        self.assertIsNotNone(statuses.wait_for(lambda s: s.state == TrackerStatus.TRACKING))
        self.assertTrue(os.path.exists(stored))


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "camera_launch_test", CameraLaunchTest)
