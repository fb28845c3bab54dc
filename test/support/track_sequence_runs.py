"""For tests: runs of track_sequence, and a simulated room that was tracked once. PROGRAMS names the folder of the
programs."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

import cv2
import numpy

FRAMES = 20

SLOWNESS = float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))  # of this build: with a sanitizer 10


def run_program(name, *arguments):
    program = os.path.join(os.environ["PROGRAMS"], name)
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=300 * SLOWNESS)


def content(*parts):
    with open(os.path.join(*parts), "rb") as f:
        return f.read()


def lines(*parts):
    return content(*parts).decode().splitlines()


def rows(*parts):
    """The columns of the lines of a text file that are no comment."""
    return [line.split() for line in lines(*parts) if line and not line.startswith("#")]


def report(output):
    return json.loads(content(output, "report.json"))


class Runs(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, *parts):
        return os.path.join(self.folder.name, *parts)

    def track(self, *arguments, status=0):
        """Runs the program; the output folder and what it said. status: None where any will do."""
        output = self.path("out%d" % len(os.listdir(self.folder.name)))
        result = run_program("track_sequence", "--quiet", "--output", output, *arguments)
        if status is not None:
            self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(result.stdout, "")
        return output, result.stderr

    def error_of(self, reference, output, name="trajectory.txt"):
        result = run_program("evaluate_trajectory", "--reference", reference, "--estimate", os.path.join(output, name),
                             "--json", os.path.join(output, "error.json"))
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(content(output, "error.json"))

    def expect_trajectory(self, stamps, path):
        poses = rows(path)
        self.assertEqual([pose[0] for pose in poses], stamps)
        for pose in poses:
            self.assertEqual(len(pose), 8)
            self.assertAlmostEqual(numpy.linalg.norm([float(q) for q in pose[4:]]), 1, places=6)


class RunsOfARoom(Runs):
    """A simulated room, made and tracked once."""

    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.TemporaryDirectory()
        cls.sequence = os.path.join(cls.made.name, "room")
        result = run_program("simulate_sequence", "--output", cls.sequence, "--scene", "room", "--frames", str(FRAMES),
                             "--width", "320", "--height", "240", "--noise", "1", "--rate", "10", "--first-stamp", "7.5",
                             "--quiet")
        assert result.returncode == 0, result.stderr
        cls.images = os.path.join(cls.sequence, "images")
        cls.list = os.path.join(cls.sequence, "images.txt")
        cls.camera = os.path.join(cls.sequence, "camera.yaml")
        cls.truth = os.path.join(cls.sequence, "groundtruth.txt")
        cls.names = sorted(os.listdir(cls.images))
        cls.stamps = ["%.9f" % (7.5 + 0.1 * i) for i in range(FRAMES)]
        cls.tracked = os.path.join(cls.made.name, "tracked")
        cls.result = run_program("track_sequence", "--images", cls.list, "--camera", cls.camera, "--output", cls.tracked)

    @classmethod
    def tearDownClass(cls):
        cls.made.cleanup()

    def copy_of_images(self):
        shutil.copytree(self.images, self.path("images"))
        return self.path("images")

    def list_of(self, names):
        path = self.path("list.txt")
        with open(path, "w") as f:
            f.write("# a comment\n")
            for i, name in enumerate(names):
                f.write("%.9f %s\n" % (1 + 0.1 * i, os.path.join(self.images, name)))
        return path

    def resize(self, path):
        cv2.imwrite(path, cv2.resize(cv2.imread(path), (160, 120)))

    def expect_refused(self, parts, *arguments, output=None):
        """One line that names what is wrong, exit status 2, nothing written."""
        output = output or self.path("refused")
        result = run_program("track_sequence", "--output", output, *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)
        self.assertFalse(os.path.exists(output))
