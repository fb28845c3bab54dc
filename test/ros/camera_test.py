#!/usr/bin/python3
"""The camera node: what it publishes from a video, what it says when there is none, and the tracker fed by it."""
import glob
import os
import signal
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy
import roslib.packages
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.srv import SetCameraInfo

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import TIMEOUT, VIDEO_FPS, Listener, write_video  # noqa: E402
from mjpeg_stream import MjpegStream, free_port  # noqa: E402


def grey_images(count):
    """Frame i is of grey level 10 + 5 i."""
    return [numpy.full((48, 64, 3), 10 + 5 * i, numpy.uint8) for i in range(count)]


class CameraTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("camera_test")
        cls.diagnostics = Listener("/diagnostics", DiagnosticArray)

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.video = os.path.join(self.folder.name, "video.avi")
        self.calibration = os.path.join(self.folder.name, "calibration.yaml")

    def start(self, name, **parameters):
        program = roslib.packages.find_node("mono_pose_tracker", "camera_node")[0]
        parameters.setdefault("camera_info_url", self.calibration)
        node = subprocess.Popen([program, "__name:=" + name, *(f"_{k}:={v}" for k, v in parameters.items())])
        self.addCleanup(self.stop, node)
        return node

    def load(self, nodelet, name, *remappings):
        """Into the manager; unloaded when the process that is returned ends."""
        program = roslib.packages.find_node("nodelet", "nodelet")[0]
        loader = subprocess.Popen([program, "load", "mono_pose_tracker/" + nodelet, "manager", "__name:=" + name,
                                   *remappings])
        self.addCleanup(self.stop, loader)
        return loader

    def stop(self, node):
        """Ends by itself when told to."""
        if node.poll() is None:
            node.send_signal(signal.SIGINT)
        try:
            self.assertEqual(node.wait(TIMEOUT), 0)
        finally:
            node.kill()

    def diagnosis(self, name, condition):
        """The status of the camera that meets the condition."""
        found = []

        def holds(array):
            found[:] = [s for s in array.status if s.name == name + ": camera" and condition(s)]
            return bool(found)
        self.assertIsNotNone(self.diagnostics.wait_for(holds), f"{name} never said so on /diagnostics")
        return found[0]

    def test_a_camera_that_appears_late_and_is_unplugged(self):
        images = Listener("late/image_raw", Image)
        infos = Listener("late/camera_info", CameraInfo)
        port = free_port()
        url = f"http://127.0.0.1:{port}/stream"
        self.start("late", device=url, frame_id="lens")
        status = self.diagnosis("late", lambda s: s.level == DiagnosticStatus.ERROR and "cannot be opened" in s.message)
        self.assertIn(url, status.message)
        self.assertEqual(len(images.messages), 0)
        images.wait_for_publisher()

        for _ in range(2):  # plugged in, and again
            before = len(images.messages)
            stream = MjpegStream(port, grey_images(30), VIDEO_FPS)
            try:
                self.assertTrue(images.wait_for_number(before + 5))
                self.diagnosis("late", lambda s: s.level == DiagnosticStatus.WARN and "images arrive" in s.message)
            finally:
                stream.close()
            self.diagnosis("late", lambda s: s.level == DiagnosticStatus.ERROR)
        self.assertEqual({(m.width, m.height, m.encoding, m.header.frame_id) for m in images.messages},
                         {(64, 48, "bgr8", "lens")})
        # A camera_info goes with every image; of a camera that is not calibrated it has the size alone.
        self.assertIsNotNone(infos.wait_for(lambda m: m.header.stamp == images.messages[-1].header.stamp))
        self.assertEqual((infos.messages[0].width, infos.messages[0].height, infos.messages[0].K[0]), (64, 48, 0))

    def test_a_video_is_played_at_its_own_pace_to_its_end(self):
        count = 30
        write_video(self.video, grey_images(count))
        images = Listener("played/image_raw", Image)
        self.start("played", video=self.video)
        last = 10 + 5 * (count - 1)
        self.assertIsNotNone(images.wait_for(lambda m: abs(m.data[0] - last) < 3))
        levels = [m.data[0] for m in images.messages]
        self.assertEqual(levels, sorted(levels))
        stamps = [m.header.stamp.to_sec() for m in images.messages]
        self.assertAlmostEqual(numpy.median(numpy.diff(stamps)), 1 / VIDEO_FPS, delta=0.5 / VIDEO_FPS)
        self.diagnosis("played", lambda s: s.level == DiagnosticStatus.OK and "ended" in s.message)

    def test_the_calibration_tool_can_store_its_result(self):
        write_video(self.video, grey_images(10))
        infos = Listener("calibrated/camera_info", CameraInfo)
        node = self.start("calibrated", video=self.video, loop="true", camera_name="left")
        self.diagnosis("calibrated", lambda s: s.level == DiagnosticStatus.WARN and "not calibrated" in s.message)
        rospy.wait_for_service("calibrated/set_camera_info", TIMEOUT)
        calibration = CameraInfo(width=64, height=48, distortion_model="plumb_bob", D=[-0.1, 0, 0, 0, 0])
        calibration.K = [50.0, 0, 32, 0, 50, 24, 0, 0, 1]
        calibration.R = [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
        calibration.P = [50.0, 0, 32, 0, 0, 50, 24, 0, 0, 0, 1, 0]
        answer = rospy.ServiceProxy("calibrated/set_camera_info", SetCameraInfo)(calibration)
        self.assertTrue(answer.success, answer.status_message)
        told = infos.wait_for(lambda m: m.K[0] == 50.0)
        self.assertIsNotNone(told)
        self.assertEqual(told.D[0], -0.1)
        self.diagnosis("calibrated", lambda s: s.level == DiagnosticStatus.OK and "images arrive" in s.message)
        # It is there again after a restart.
        self.stop(node)
        again = Listener("again/camera_info", CameraInfo)
        self.start("again", video=self.video, loop="true", camera_name="left")
        self.assertIsNotNone(again.wait_for(lambda m: m.K[0] == 50.0))

    def test_no_such_device(self):
        self.start("unplugged", device="/dev/no_such_video")
        status = self.diagnosis("unplugged", lambda s: s.level == DiagnosticStatus.ERROR and "device" in s.message)
        self.assertIn("/dev/no_such_video", status.message)
        # It goes on looking.
        self.diagnosis("unplugged", lambda s: any(v.key == "failures" and int(v.value) >= 3 for v in s.values))

    def test_what_is_no_camera_is_named(self):
        self.start("strange", device="/dev/null")
        self.diagnosis("strange", lambda s: s.level == DiagnosticStatus.ERROR and "cannot be opened" in s.message)

    def refused(self, parameter):
        """What the node prints, which ends by itself."""
        program = roslib.packages.find_node("mono_pose_tracker", "camera_node")[0]
        result = subprocess.run([program, "__name:=refused", parameter], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                text=True, timeout=TIMEOUT)
        rospy.delete_param("/refused")
        self.assertEqual(result.returncode, 1, result.stdout)
        return result.stdout

    def test_bad_parameters_are_refused(self):
        for parameter, said in (("_pixel_format:=MJPEG", "~pixel_format is MJPEG, expected four letters"),
                                ("_camera_info_url:=http://x/y", "~camera_info_url is http://x/y, expected a path"),
                                ("_rate:=1e-12", "~rate is 1e-12, expected 0")):
            self.assertIn(said, self.refused(parameter))

    def test_a_file_that_is_no_video_ends_the_node(self):
        """A pipe too, into which nobody writes: to open it would wait for ever."""
        os.mkfifo(self.folder.name + "/pipe")
        for name, content in (("empty.mp4", b""), ("text.avi", b"not a video")):
            with open(os.path.join(self.folder.name, name), "wb") as file:
                file.write(content)
        write_video(self.video, grey_images(10))
        with open(self.video, "rb") as whole, open(self.folder.name + "/head.avi", "wb") as file:
            file.write(whole.read(2000))  # no image is whole
        for source, said in (("_video:=%s/none.avi", "no such video: %s/none.avi"),
                             ("_video:=%s/pipe", "%s/pipe is not a regular file"),
                             ("_video:=%s/empty.mp4", "%s/empty.mp4: cannot be opened as a video: expected"),
                             ("_video:=%s/text.avi", "%s/text.avi: cannot be opened as a video: expected"),
                             ("_video:=%s/head.avi", "%s/head.avi: "),
                             ("_device:=%s/video.avi", "~device is %s/video.avi, which is a file: expected a V4L2 device")):
            output = self.refused(source % self.folder.name)
            self.assertIn(said % self.folder.name, output)
            self.assertNotIn("retrying", output)

    def test_a_pipe_in_place_of_a_calibration_is_refused(self):
        """By both nodes, at once: to open it would wait for ever, and past Ctrl-C."""
        os.mkfifo(self.calibration)
        write_video(self.video, grey_images(3))
        for kind, source in (("camera_node", "_video:=" + self.video), ("tracker_node", "image:=none/image_raw")):
            program = roslib.packages.find_node("mono_pose_tracker", kind)[0]
            for url in (self.calibration, "file://" + self.calibration):
                result = subprocess.run([program, "__name:=calibrated_by_pipe", source, "_camera_info_url:=" + url],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT)
                rospy.delete_param("/calibrated_by_pipe")
                self.assertEqual(result.returncode, 1)
                self.assertIn(self.calibration + " is not a regular file", result.stdout)

    def test_with_the_tracker_in_one_manager(self):
        folder = self.folder.name
        simulate_sequence = roslib.packages.find_node("mono_pose_tracker", "simulate_sequence")[0]
        subprocess.run([simulate_sequence, "--scene", "room", "--output", folder, "--frames", "40", "--width", "320",
                        "--height", "240", "--samples", "1", "--quiet"], check=True)
        write_video(self.video, [cv2.imread(f) for f in sorted(glob.glob(folder + "/images/*"))])
        poses = Listener("tracker/pose", PoseWithCovarianceStamped)
        images = Listener("live/image_raw", Image)
        for key, value in (("video", self.video), ("loop", True), ("camera_info_url", folder + "/camera.yaml"),
                           ("rate", 10.0)):
            rospy.set_param("live/" + key, value)
        self.load("TrackerNodelet", "tracker", "image:=live/image_raw")
        camera = self.load("CameraNodelet", "live")
        self.assertTrue(poses.wait_for_number(10))
        self.assertIn(poses.messages[0].header.stamp, [m.header.stamp for m in images.messages])
        self.diagnosis("live", lambda s: s.level == DiagnosticStatus.OK)
        # Unloaded while it streams, and loaded again.
        self.stop(camera)
        before = len(images.messages)
        self.load("CameraNodelet", "live")
        self.assertTrue(images.wait_for_number(before + 5))


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "camera_test", CameraTest)
