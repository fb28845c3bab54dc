#!/usr/bin/python3
"""What one message or call must not do: end the process, or leave the node deaf. Each is answered, and the next image
as ever."""
import os
import struct
import sys
import time
import unittest
import zlib

import cv2
import numpy
import rospy
import rostest
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from feeding import TIMEOUT, Tracker, wait_for_connections  # noqa: E402
from listening import HEIGHT, WIDTH, camera_info  # noqa: E402


def png_that_promises(side):
    """A PNG file with a sound head, of so many pixels by as many."""
    head = b"IHDR" + struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head)) + b"\0" * 100


class HostileTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("hostile_test")
        cls.raw, cls.packed = Tracker("/tracker"), Tracker("/tracker_compressed")
        cls.images = rospy.Publisher("/camera/image_raw", Image, queue_size=10)
        cls.compressed = rospy.Publisher("/camera/image_raw/compressed", CompressedImage, queue_size=10)
        cls.infos = rospy.Publisher("/camera/camera_info", CameraInfo, queue_size=10)
        wait_for_connections(cls.images, cls.compressed, cls.infos)
        cls.seconds = 1000
        cls.noise = numpy.random.RandomState(1).randint(0, 256, (HEIGHT, WIDTH), dtype=numpy.uint8)

    def answer(self, tracker, publisher, message):
        HostileTest.seconds += 1
        message.header.stamp = rospy.Time(self.seconds)
        before = len(tracker.statuses)
        publisher.publish(message)
        self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) > before), "an image was not answered")
        self.assertEqual(tracker.statuses[before].header.stamp, message.header.stamp)
        return tracker.statuses[before]

    def raw_answer(self, **fields):
        return self.answer(self.raw, self.images, Image(**fields))

    def packed_answer(self, data):
        return self.answer(self.packed, self.compressed, CompressedImage(format="", data=data))

    def expect_alive(self):
        """A sound image is unlike what was refused."""
        refused = (TrackerStatus.UNREADABLE_IMAGE, TrackerStatus.INTERNAL_ERROR)
        self.assertNotIn(self.sound_answer().reason, refused)
        png = cv2.imencode(".png", self.noise)[1].tobytes()
        self.assertNotIn(self.packed_answer(png).reason, refused)

    def sound_answer(self):
        return self.raw_answer(width=WIDTH, height=HEIGHT, step=WIDTH, encoding="mono8", data=self.noise.tobytes())

    def expect_tracked(self):
        """Whatever was wrong with the calibration is over: images are looked at again."""
        deadline = time.monotonic() + TIMEOUT
        while self.sound_answer().state != TrackerStatus.BOOTSTRAPPING:
            self.assertLess(time.monotonic(), deadline, "the good calibration never came in force")

    def test_raw_images_whose_sizes_wrap(self):
        for width, height, step in ((640, 2, 2**31), (2**31, 1, 0), (2**31, 2, 2**31), (2**32 - 1, 2**32 - 1, 2**32 - 1)):
            for encoding in ("yuv422_yuy2", "yuv422", "mono8", "bgr8", "bayer_rggb16"):
                status = self.raw_answer(width=width, height=height, step=step, encoding=encoding, data=bytes(100))
                self.assertEqual(status.reason, TrackerStatus.UNREADABLE_IMAGE, (encoding, width, height, step))
        self.expect_alive()

    def test_compressed_images_that_cannot_be(self):
        jpeg = cv2.imencode(".jpg", self.noise)[1].tobytes()
        for data in (png_that_promises(100000), png_that_promises(32000), png_that_promises(2000), b"", b"\xff\xd8\xff",
                     b"no image at all", jpeg[:len(jpeg) // 2], b"P5 60000 60000 255 "):
            status = self.packed_answer(data)
            self.assertEqual(status.reason, TrackerStatus.UNREADABLE_IMAGE, data[:30])
            self.assertTrue(status.reason_text)
        self.assertIn("100000 x 100000", self.packed_answer(png_that_promises(100000)).reason_text)
        # The parameter ~max_image_pixels of this node.
        self.assertIn("at most 1000000 pixels", self.packed_answer(png_that_promises(1001)).reason_text)
        self.expect_alive()

    def test_calibrations_that_no_camera_has(self):
        for change in ({"width": 2**32 - 1}, {"width": 0, "height": 0}, {"binning_x": 2**32 - 1}, {"K": [float("nan")] * 9},
                       {"D": [1.0] * 1000}, {"distortion_model": "\0" * 1000}):
            info = camera_info()
            for name, value in change.items():
                setattr(info, name, value)
            self.infos.publish(info)
            self.expect_alive()
        self.infos.publish(camera_info())
        self.expect_tracked()

    def test_options_that_are_no_numbers(self):
        change = rospy.ServiceProxy("/tracker/set_parameters", Reconfigure)
        change.wait_for_service(60)
        keys = ("mapping/keyframe_overlap", "publish_period")
        before = [rospy.get_param("/tracker/" + key) for key in keys]
        for value in (float("nan"), -float("nan")):
            change(Config(doubles=[DoubleParameter(name=key, value=value) for key in keys]))
            self.assertEqual([rospy.get_param("/tracker/" + key) for key in keys], before)
        change(Config(doubles=[DoubleParameter(name=keys[0], value=float("inf"))]))
        self.assertEqual(rospy.get_param("/tracker/" + keys[0]), 1, "the nearest in range")
        self.expect_alive()

    def test_a_pipe_that_nobody_reads(self):
        pipe = rospy.get_param("/tracker/save_trajectory_path")
        os.mkfifo(pipe)
        self.addCleanup(os.remove, pipe)
        answer = self.raw.call("save_trajectory")
        self.assertFalse(answer.success)
        self.assertIn("not a regular file", answer.message)
        self.assertTrue(self.raw.call("reset").success, "no later service waits")
        self.expect_alive()


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "hostile_test", HostileTest)
