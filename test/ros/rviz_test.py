#!/usr/bin/python3
"""rviz with the package's set-up, on a virtual display: it loads without an error, and what the tracker has found is on
the screen - points, camera positions, keyframes, the camera in the middle, and the debug image, told by their pixels.
RVIZ_SCREENSHOT=FILE keeps the last picture."""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import cv2
import numpy
import roslib.packages
import rosgraph
import rospy
import rostest

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from simulated_camera import SimulatedCamera  # noqa: E402

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401

TIMEOUT = 90  # s; software rendering on a busy machine
NEEDED = ("xvfb-run", "import", "rviz")

# As in config/tracker.rviz, red green blue; and of the frusta in src/ros/messages.cpp.
BACKGROUND, FRUSTA, CAMERA = (24, 26, 32), (0, 153, 255), (255, 64, 64)


class Display:
    """rviz in a virtual screen; the shell that runs it takes pictures when told to by a signal."""

    def __init__(self, config):
        self.folder = tempfile.mkdtemp()
        self.log = open(self.folder + "/rviz.log", "w+")
        script = ("trap 'kill $rviz; exit' TERM; rviz -d \"$0\" & rviz=$!; "
                  "while kill -0 $rviz; do [ -e \"$1/wanted\" ] && import -window root \"$1/partial.png\" && "
                  "rm \"$1/wanted\" && mv \"$1/partial.png\" \"$1/shot.png\"; sleep 0.1; done")
        self.process = subprocess.Popen(
            ["xvfb-run", "-a", "-s", "-screen 0 1440x900x24", "bash", "-c", script, config, self.folder],
            stdout=self.log, stderr=subprocess.STDOUT, start_new_session=True,
            env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "HOME": self.folder})

    def shot(self):
        """The screen, red green blue."""
        path = self.folder + "/shot.png"
        if os.path.exists(path):
            os.remove(path)
        open(self.folder + "/wanted", "w").close()
        deadline = time.monotonic() + TIMEOUT
        while not os.path.exists(path):
            if time.monotonic() > deadline or self.process.poll() is not None:
                raise AssertionError("no picture; rviz said:\n" + self.said())
            time.sleep(0.05)
        return cv2.imread(path)[:, :, ::-1].astype(int)

    def said(self):
        self.log.flush()
        with open(self.log.name) as log:
            return log.read()

    def close(self):
        """The whole session: xvfb-run leaves its children behind when it is killed."""
        os.killpg(self.process.pid, signal.SIGTERM)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
        shutil.rmtree(self.folder, ignore_errors=True)


def count(picture, color, tolerance=12):
    return numpy.count_nonzero(numpy.abs(picture - color).max(axis=2) <= tolerance)


def count_positions(picture):
    """From blue to red by time, green always 80."""
    red, green, blue = picture[:, :, 0], picture[:, :, 1], picture[:, :, 2]
    return numpy.count_nonzero((numpy.abs(green - 80) <= 6) & (numpy.abs(red + blue - 255) <= 12))


def scene(picture):
    """The 3-D view: right of the docked panels, below the tool bar."""
    return picture[60:860, 520:]


@unittest.skipUnless(all(shutil.which(program) for program in NEEDED), "needs " + ", ".join(NEEDED))
class RvizTest(unittest.TestCase):
    def wait_for_subscriber(self, topic):
        master = rosgraph.Master("rviz_test")
        deadline = time.monotonic() + TIMEOUT
        while time.monotonic() < deadline:
            subscriptions = dict(master.getSystemState()[1])
            if any(node.startswith("/rviz") for node in subscriptions.get(topic, [])):
                return
            time.sleep(0.1)
        self.fail("rviz never listened to " + topic + "; it said:\n" + self.display.said())

    def shot_that(self, condition):
        """The first picture that meets the condition, or the last one before the timeout."""
        deadline = time.monotonic() + TIMEOUT
        while True:
            picture = self.display.shot()
            if condition(picture) or time.monotonic() > deadline:
                return picture
            time.sleep(0.2)

    def test_what_is_found_is_on_the_screen(self):
        rospy.init_node("rviz_test")
        config = os.path.join(roslib.packages.get_pkg_dir("mono_pose_tracker"), "config", "tracker.rviz")
        self.display = Display(config)
        self.addCleanup(self.display.close)
        camera = SimulatedCamera("room", 48)
        for topic in ("points", "path", "keyframes", "camera_frustum", "camera_positions", "debug_image"):
            self.wait_for_subscriber("/tracker/" + topic)
        empty = self.shot_that(lambda picture: count(scene(picture), BACKGROUND, 3) > 0.8 * scene(picture).size / 3)
        self.assertGreater(count(scene(empty), BACKGROUND, 3), 0.8 * scene(empty).size / 3, "an empty scene")
        self.assertEqual(count_positions(scene(empty)), 0)
        self.assertEqual(count(scene(empty), CAMERA), 0)

        camera.calibrate(camera.calibration, lambda s: s.state == TrackerStatus.BOOTSTRAPPING)
        camera.walk_until_tracked()
        camera.walk(60)

        def shown(picture):
            view = scene(picture)
            dark = count(view, BACKGROUND, 3)
            found = {"positions": count_positions(view), "keyframes": count(view, FRUSTA, 60),
                     "camera": count(view, CAMERA, 40)}
            return {**found, "points": view.size // 3 - dark - sum(found.values())}
        # What the eye needs to see them: some hundred pixels of lines, some thousand of points.
        needed = {"positions": 100, "keyframes": 40, "camera": 100, "points": shown(empty)["points"] + 1500}
        full = self.shot_that(lambda picture: all(shown(picture)[key] > needed[key] for key in needed))
        if "RVIZ_SCREENSHOT" in os.environ:
            cv2.imwrite(os.environ["RVIZ_SCREENSHOT"], full[:, :, ::-1])
        for key, least in needed.items():
            self.assertGreater(shown(full)[key], least, key)
        # The view follows the camera: its frustum is in the middle, wherever it has gone.
        rows, columns = numpy.nonzero(numpy.abs(scene(full) - CAMERA).max(axis=2) <= 40)
        height, width = scene(full).shape[:2]
        self.assertLess(abs(numpy.median(columns) / width - 0.5), 0.2)
        self.assertLess(abs(numpy.median(rows) / height - 0.5), 0.2)
        # The dots of the debug image, in the panel beside: none of its colours is rviz's own.
        panel_before, panel = empty[:, :500], full[:, :500]
        self.assertGreater(count(panel, (80, 220, 80), 40), count(panel_before, (80, 220, 80), 40) + 100)

        problems = [line for line in self.display.said().splitlines() if "ERROR" in line or "FATAL" in line]
        self.assertEqual(problems, [])


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "rviz_test", RvizTest)
