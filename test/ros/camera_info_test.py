#!/usr/bin/python3
"""A calibration that is missing, in a file, or that changes: what the node says of it, and what it does."""
import unittest

import numpy
import rospy
import rostest
from listening import Listener
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image

from mono_pose_tracker.msg import TrackerStatus

WIDTH, HEIGHT = 160, 120


def camera_info(focal):
    info = CameraInfo(width=WIDTH, height=HEIGHT, distortion_model="plumb_bob", D=[0.0] * 5)
    info.K = [focal, 0, WIDTH / 2, 0, focal, HEIGHT / 2, 0, 0, 1]
    info.P = [focal, 0, WIDTH / 2, 0, 0, focal, HEIGHT / 2, 0, 0, 0, 1, 0]
    return info


class Camera:
    def __init__(self, namespace, node):
        self.node = node
        self.images = rospy.Publisher(namespace + "/image_raw", Image, queue_size=10)
        self.infos = rospy.Publisher(namespace + "/camera_info", CameraInfo, queue_size=10)
        self.statuses = Listener(node + "/status", TrackerStatus)
        self.noise = numpy.random.RandomState(1)
        self.seconds = 1000.0
        for connection in (self.images, self.infos, self.statuses.subscriber):
            while connection.get_num_connections() == 0 and not rospy.is_shutdown():
                rospy.sleep(0.02)

    def show(self):
        """The status that answers a new image."""
        self.seconds += 0.1
        data = self.noise.randint(0, 256, WIDTH * HEIGHT, dtype=numpy.uint8).tobytes()
        image = Image(width=WIDTH, height=HEIGHT, encoding="mono8", step=WIDTH, data=data)
        image.header.stamp = rospy.Time.from_sec(self.seconds)
        image.header.frame_id = "camera"
        self.images.publish(image)
        return self.statuses.wait_for(lambda s: s.header.stamp == image.header.stamp)

    def calibrate(self, focal, is_taken):
        """Sends it until an image's status shows that it is taken; that status."""
        for _ in range(100):
            self.infos.publish(camera_info(focal))
            status = self.show()
            if is_taken(status):
                return status
        raise AssertionError("the calibration was not taken")


class CameraInfoTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("camera_info_test")
        cls.log = Listener("/rosout", Log)
        cls.camera = Camera("/camera", "/tracker")

    def heard(self, node, *words):
        return self.log.wait_for(lambda m: m.name == node and all(word in m.msg for word in words))

    def test_1_a_missing_calibration_is_named_with_what_to_do(self):
        said = None
        while said is None and len(self.camera.statuses.messages) < 1000:
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
        self.assertIsNotNone(self.heard("/tracker", "the calibration has changed"))

    def test_3_the_file_serves_until_a_calibration_comes(self):
        camera = Camera("/uncalibrated_camera", "/tracker_with_file")
        status = camera.show()
        self.assertEqual(status.state_name, "BOOTSTRAPPING", status.reason_text)
        taken = camera.calibrate(250.0, lambda s: s.epoch > status.epoch)
        self.assertEqual(taken.state_name, "BOOTSTRAPPING", "camera_info wins over the file")


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "camera_info_test", CameraInfoTest)
