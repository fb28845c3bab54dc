#!/usr/bin/python3
"""Whatever image comes, the node answers it by one status that says what is wrong, and goes on."""
import os
import sys
import threading
import time
import unittest

import cv2
import numpy
import rospy
import rostest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from feeding import SLOWNESS, wait_for_connections  # noqa: E402
from listening import HEIGHT, WIDTH, Listener, camera_info  # noqa: E402

TIMEOUT = 30 * SLOWNESS  # s; on a busy machine an image takes a second
BYTES = {"mono8": 1, "8UC1": 1, "mono16": 2, "16UC1": 2, "rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4,
         "bayer_rggb8": 1, "bayer_bggr8": 1, "bayer_gbrg8": 1, "bayer_grbg8": 1, "yuv422": 2, "yuv422_yuy2": 2,
         "bayer_rggb16": 2, "bayer_bggr16": 2, "bayer_gbrg16": 2, "bayer_grbg16": 2, "32FC1": 4, "rgb16": 6,
         "bgr16": 6, "rgba16": 8, "8UC4": 4, "16UC3": 6, "no_such_encoding": 1}
UNSUPPORTED = ("32FC1", "no_such_encoding")


class StatusTest(unittest.TestCase):
    """The tests share one node: each publishes its calibration and newer stamps than the one before."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("status_test")
        cls.changed = threading.Condition()
        cls.statuses = []
        cls.transforms = []
        cls.images = rospy.Publisher("/camera/image_raw", Image, queue_size=100)
        cls.infos = rospy.Publisher("/camera/camera_info", CameraInfo, queue_size=10)
        cls.subscribers = [rospy.Subscriber("/tracker/status", TrackerStatus, cls.on_status, queue_size=1000),
                           rospy.Subscriber("/tf", TFMessage, cls.transforms.append, queue_size=1000)]
        cls.noise = numpy.random.RandomState(1)
        cls.seconds = 1000.0
        for connection in (cls.images, cls.infos, cls.subscribers[0]):
            while connection.get_num_connections() == 0 and not rospy.is_shutdown():
                rospy.sleep(0.05)

    @classmethod
    def on_status(cls, status):
        with cls.changed:
            cls.statuses.append(status)
            cls.changed.notify_all()

    def next_seconds(self):
        StatusTest.seconds += 0.1
        return self.seconds

    def image(self, seconds, encoding="mono8", width=WIDTH, height=HEIGHT):
        step = width * BYTES[encoding]
        data = self.noise.randint(0, 256, step * height, dtype=numpy.uint8).tobytes()
        message = Image(width=width, height=height, encoding=encoding, step=step, data=data)
        message.header.stamp = rospy.Time.from_sec(seconds)
        message.header.frame_id = "camera"
        return message

    def answers(self, images):
        """The statuses that answer these images, which are sent at once."""
        before = len(self.statuses)
        for image in images:
            self.images.publish(image)
        with self.changed:
            self.changed.wait_for(lambda: len(self.statuses) >= before + len(images), TIMEOUT)
        return self.statuses[before:]

    def answer(self, image):
        found = self.answers([image])
        self.assertEqual(len(found), 1, "one status for one image")
        self.assertEqual(found[0].header.stamp, image.header.stamp)
        self.assertEqual(found[0].header.frame_id, image.header.frame_id)
        return found[0]

    def calibrate(self, info):
        """Sends a calibration until the node has it: told by the answer to an image of its size."""
        self.infos.publish(info)
        expected = {TrackerStatus.UNCALIBRATED} if info.K[0] == 0 else None
        for _ in range(50):
            status = self.answer(self.image(self.next_seconds(), width=info.width, height=info.height))
            bad = {TrackerStatus.NO_CAMERA_INFO, TrackerStatus.UNCALIBRATED, TrackerStatus.IMAGE_SIZE_MISMATCH}
            if status.reason in expected if expected else status.reason not in bad:
                return
            rospy.sleep(0.05)
        self.fail("the calibration never arrived")

    def call(self, name):
        rospy.wait_for_service("/tracker/" + name, TIMEOUT)
        return rospy.ServiceProxy("/tracker/" + name, Trigger)()

    def test_0_no_camera_info(self):
        status = self.answer(self.image(self.next_seconds()))
        self.assertEqual(status.reason, TrackerStatus.NO_CAMERA_INFO)
        self.assertEqual(status.reason_name, "NO_CAMERA_INFO")
        self.assertEqual(status.state, TrackerStatus.WAITING_FOR_CAMERA_INFO)

    def test_1_uncalibrated(self):
        self.calibrate(camera_info(focal=0.0))
        status = self.answer(self.image(self.next_seconds()))
        self.assertEqual(status.reason, TrackerStatus.UNCALIBRATED)
        self.assertIn("camera_calibration", status.reason_text)

    def test_image_size_mismatch(self):
        self.calibrate(camera_info())
        status = self.answer(self.image(self.next_seconds(), width=2 * WIDTH))
        self.assertEqual(status.reason, TrackerStatus.IMAGE_SIZE_MISMATCH)
        self.assertIn("320x120", status.reason_text)
        self.assertIn("160x120", status.reason_text)

    def test_unsupported_encodings(self):
        self.calibrate(camera_info())
        for encoding in UNSUPPORTED:
            status = self.answer(self.image(self.next_seconds(), encoding))
            self.assertEqual(status.reason, TrackerStatus.UNSUPPORTED_ENCODING, encoding)
            self.assertIn(encoding, status.reason_text)

    def test_supported_encodings(self):
        self.calibrate(camera_info())
        for encoding in sorted(set(BYTES) - set(UNSUPPORTED)):
            status = self.answer(self.image(self.next_seconds(), encoding))
            self.assertIn(status.state, (TrackerStatus.BOOTSTRAPPING, TrackerStatus.TRACKING), encoding)
            self.assertGreater(status.features, 0, encoding)

    def test_image_that_is_too_short(self):
        self.calibrate(camera_info())
        image = self.image(self.next_seconds())
        image.data = image.data[:100]
        self.assertEqual(self.answer(image).reason, TrackerStatus.UNREADABLE_IMAGE)

    def test_stale_stamps(self):
        self.calibrate(camera_info())
        now = self.next_seconds()
        dropped = self.answer(self.image(now)).frames_dropped
        for stale in (now, now - 0.5):
            status = self.answer(self.image(stale))
            self.assertEqual(status.reason, TrackerStatus.STALE_STAMP)
            dropped += 1
            self.assertEqual(status.frames_dropped, dropped)
        self.assertEqual(self.answer(self.image(self.next_seconds())).state, TrackerStatus.BOOTSTRAPPING)

    def test_jump_back_in_time(self):
        self.calibrate(camera_info())
        epoch = self.answer(self.image(self.next_seconds())).epoch
        StatusTest.seconds -= 500
        status = self.answer(self.image(self.next_seconds()))
        self.assertEqual(status.reason, TrackerStatus.TIME_JUMP)
        self.assertEqual(status.epoch, epoch + 1)
        self.assertEqual(self.answer(self.image(self.next_seconds())).epoch, epoch + 1)

    def test_changed_calibration(self):
        self.calibrate(camera_info())
        epoch = self.answer(self.image(self.next_seconds())).epoch
        self.calibrate(camera_info(width=2 * WIDTH))
        status = self.answer(self.image(self.next_seconds(), width=2 * WIDTH))
        self.assertEqual(status.state, TrackerStatus.BOOTSTRAPPING)
        self.assertGreater(status.epoch, epoch)

    def test_a_burst(self):
        self.calibrate(camera_info())
        images = [self.image(self.next_seconds(), width=WIDTH) for _ in range(40)]
        received = self.statuses[-1].frames_received
        dropped = self.statuses[-1].frames_dropped
        found = self.answers(images)
        self.assertEqual(sorted(s.header.stamp for s in found), [i.header.stamp for i in images])
        self.assertEqual(max(s.frames_received for s in found), received + len(images))
        self.assertEqual(max(s.frames_dropped for s in found) - dropped,
                         sum(s.reason == TrackerStatus.DROPPED for s in found))
        newest = next(s for s in found if s.header.stamp == images[-1].header.stamp)
        self.assertNotEqual(newest.reason, TrackerStatus.DROPPED, "the newest image is never displaced")

    def test_pause_and_resume(self):
        self.calibrate(camera_info())
        self.assertTrue(self.call("pause").success)
        status = self.answer(self.image(self.next_seconds()))
        self.assertEqual((status.state, status.reason), (TrackerStatus.PAUSED, TrackerStatus.REASON_PAUSED))
        self.assertTrue(self.call("resume").success)
        self.assertEqual(self.answer(self.image(self.next_seconds())).state, TrackerStatus.BOOTSTRAPPING)

    def test_reset(self):
        self.calibrate(camera_info())
        epoch = self.answer(self.image(self.next_seconds())).epoch
        self.assertTrue(self.call("reset").success)
        self.assertEqual(self.answer(self.image(self.next_seconds())).epoch, epoch + 1)

    def test_compressed_images(self):
        images = rospy.Publisher("/compressed_camera/image_raw/compressed", CompressedImage, queue_size=10)
        infos = rospy.Publisher("/compressed_camera/camera_info", CameraInfo, queue_size=1, latch=True)
        infos.publish(camera_info())
        statuses = Listener("/tracker_compressed/status", TrackerStatus)
        wait_for_connections(images, infos, statuses.subscriber)
        pixels = self.noise.randint(0, 256, (HEIGHT, WIDTH, 3), dtype=numpy.uint8)
        deadline = time.monotonic() + TIMEOUT
        status = None
        # The calibration may arrive after the first images.
        while status is None or status.reason == TrackerStatus.NO_CAMERA_INFO:
            self.assertLess(time.monotonic(), deadline, "the calibration never arrived")
            image = CompressedImage(format="png", data=cv2.imencode(".png", pixels)[1].tobytes())
            image.header.stamp = rospy.Time.from_sec(self.next_seconds())
            images.publish(image)
            status = statuses.wait_for(lambda s: s.header.stamp == image.header.stamp)
            self.assertIsNotNone(status, "every image is answered")
        self.assertEqual(status.state, TrackerStatus.BOOTSTRAPPING, status.reason_text)
        self.assertGreater(status.features, 0, "it was decoded")

    def test_no_pose_is_no_trajectory(self):
        answer = self.call("save_trajectory")
        self.assertFalse(answer.success, answer.message)
        self.assertEqual(answer.message, "there is no pose yet")

    def test_noise_gives_no_pose(self):
        self.calibrate(camera_info())
        for _ in range(20):
            self.assertNotEqual(self.answer(self.image(self.next_seconds())).state, TrackerStatus.TRACKING)
        self.assertFalse([t for m in self.transforms for t in m.transforms])
        self.assertEqual(self.statuses[-1].frames_posed, 0)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "status_test", StatusTest)
