#!/usr/bin/python3
"""What simulate_sequence writes and exits with. PROGRAMS names the folder of the program."""
import os
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy
import rosbag
import rosunit
import yaml
from cv_bridge import CvBridge

SMALL = ["--width", "120", "--height", "90", "--quiet"]


def lines(path):
    with open(path) as f:
        return f.read().splitlines()


class SimulateSequence(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, *parts):
        return os.path.join(self.folder.name, *parts)

    def run_program(self, *arguments):
        program = os.path.join(os.environ["PROGRAMS"], "simulate_sequence")
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)

    def simulate(self, output, *arguments):
        result = self.run_program("--output", output, *SMALL, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout + result.stderr, "")

    def expect_refused(self, part, *arguments):
        result = self.run_program(*SMALL, *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(part, result.stderr)

    def test_files_and_bag_tell_the_same(self):
        out = self.path("made", "here")
        self.simulate(out, "--scene", "room", "--frames", "3", "--first-stamp", "10.5", "--rate", "20",
                      "--distortion", "-0.28,0.07,0.0002,0.00002,0", "--bag-masks")
        listed = [line.split() for line in lines(os.path.join(out, "images.txt"))]
        poses = [line.split() for line in lines(os.path.join(out, "groundtruth.txt"))]
        stamps = ["10.500000000", "10.550000000", "10.600000000"]
        self.assertEqual([stamp for stamp, _ in listed], stamps)
        self.assertEqual([pose[0] for pose in poses], stamps)
        self.assertEqual([len(pose) for pose in poses], [8, 8, 8])
        with open(os.path.join(out, "camera.yaml")) as f:
            camera = yaml.safe_load(f)
        self.assertEqual((camera["image_width"], camera["image_height"]), (120, 90))
        # PyYAML takes 2e-05 for a string.
        distortion = [float(k) for k in camera["distortion_coefficients"]["data"]]
        self.assertEqual(distortion, [-0.28, 0.07, 0.0002, 0.00002, 0])
        read = {"/camera/image_raw": [], "/camera/camera_info": [], "/camera/mask": []}
        with rosbag.Bag(os.path.join(out, "sequence.bag")) as bag:
            for topic, message, _ in bag.read_messages():
                self.assertEqual(message.header.frame_id, "camera_optical")
                read[topic].append(message)
        for i, (stamp, name) in enumerate(listed):
            image = cv2.imread(os.path.join(out, name), cv2.IMREAD_UNCHANGED)
            mask = cv2.imread(os.path.join(out, "masks", os.path.basename(name)), cv2.IMREAD_UNCHANGED)
            self.assertTrue(numpy.array_equal(image, CvBridge().imgmsg_to_cv2(read["/camera/image_raw"][i])))
            self.assertTrue(numpy.array_equal(mask, CvBridge().imgmsg_to_cv2(read["/camera/mask"][i])))
            self.assertTrue((mask == 255).all())
            for messages in read.values():
                self.assertEqual("%.9f" % messages[i].header.stamp.to_sec(), stamp)
            info = read["/camera/camera_info"][i]
            self.assertEqual(list(info.K), camera["camera_matrix"]["data"])
            self.assertEqual(list(info.D), distortion)
            self.assertEqual(info.distortion_model, "plumb_bob")

    def test_one_seed_one_result(self):
        for name, seed in (("a", "4"), ("b", "4"), ("c", "5")):
            self.simulate(self.path(name), "--frames", "1", "--noise", "2", "--seed", seed)
        read = {name: open(self.path(name, "images", "000000.png"), "rb").read() for name in "abc"}
        self.assertEqual(read["a"], read["b"])
        self.assertNotEqual(read["a"], read["c"])

    def test_heads_as_they_are_filmed(self):
        for name, *options in (("plain",), ("portrait", "--shoulders", "sway", "--speaks", "--blinks", "--loose-hair", "--shine",
                                            "0.3", "--background", "wall"),
                               ("bust", "--scene", "turntable", "--background", "room", "--hand-held")):
            self.simulate(self.path(name), "--frames", "2", *options)
        area = {name: (cv2.imread(self.path(name, "masks", "000001.png"), 0) > 0).mean()
                for name in ("plain", "portrait", "bust")}
        self.assertLess(area["portrait"], 0.5 * area["plain"])  # further away, without its neck
        self.assertTrue(0.1 < area["bust"] < 0.4, area)
        corner = cv2.imread(self.path("portrait", "images", "000001.png"))[:20, :20]
        self.assertGreater(corner.mean(), 180)

    def test_a_path_of_ones_own(self):
        given = ["5.000000000 0 0 -0.6 0 0 0 1", "5.250000000 0.1 0 -0.6 0 0 0 1"]
        with open(self.path("path.txt"), "w") as f:
            f.write("\n".join(given) + "\n")
        self.simulate(self.path("out"), "--path", self.path("path.txt"))
        written = [[float(v) for v in line.split()] for line in lines(self.path("out", "groundtruth.txt"))]
        self.assertEqual(written, [[float(v) for v in line.split()] for line in given])

    def test_files_are_not_written_over_each_other(self):
        out = self.path("out")
        os.mkdir(out)
        for name in ("images.txt", "groundtruth.txt", "camera.yaml"):
            self.expect_refused("would be written twice, by --output and by --bag", "--frames", "1", "--output", out, "--bag",
                                os.path.join(out, name))
        pose = "5.000000000 0 0 -0.6 0 0 0 1\n# mine\n"
        for name in ("groundtruth.txt", "images.txt"):
            path = os.path.join(out, name)
            with open(path, "w") as f:
                f.write(pose)
            self.expect_refused(name + ": would be written over", "--path", path, "--output", out)
            self.assertEqual(open(path).read(), pose)
            self.assertEqual(os.listdir(out), [name])
            os.remove(path)

    def test_refusals_name_what_is_wrong(self):
        out = ["--output", self.path("out")]
        with open(self.path("file"), "w") as f:
            f.write("no pose\n")
        with open(self.path("empty"), "w"):
            pass
        self.expect_refused("--output")
        self.expect_refused("--scene", *out, "--scene", "attic")
        self.expect_refused("--frames", *out, "--frames", "0")
        self.expect_refused("--hfov", *out, "--hfov", "180")
        self.expect_refused("speaks", *out, "--scene", "room", "--speaks")
        self.expect_refused("hand_held", *out, "--background", "wall", "--hand-held")
        self.expect_refused("shine = 2", *out, "--shine", "2")
        self.expect_refused("fx", *out, "--focal", "-5")
        for option, value, named in (("--lead-in", "2147483647", "lead_in = 2147483647"),
                                     ("--frames", "2147483647", "frames = 2147483647"),
                                     ("--rate", "1e-300", "rate_hz = 1e-300"), ("--rate", "1e10", "rate_hz = 10000000000"),
                                     ("--first-stamp", "5e9", "first_stamp_s = 5000000000")):
            self.expect_refused(named, *out, option, value)
        for width, height in (("65535", "65535"), ("2147483647", "90")):
            result = self.run_program(*out, "--width", width, "--height", height)
            self.assertEqual((result.returncode, result.stderr.count("\n")), (2, 1), result.stderr)
            self.assertIn("expected 100000000 pixels at most", result.stderr)
        for stamp in ("-5", "4294967296"):
            with open(self.path("path"), "w") as f:
                f.write("%s 0 0 -0.6 0 0 0 1\n" % stamp)
            self.expect_refused("image 1 of 1: the time stamp " + stamp, *out, "--path", self.path("path"))
        self.assertFalse(os.path.exists(self.path("out")))
        self.expect_refused("noise_grey_levels", *out, "--noise", "-1")
        self.expect_refused("fisheye", *out, "--distortion-model", "fisheye")
        self.expect_refused(self.path("missing"), *out, "--path", self.path("missing"))
        self.expect_refused(self.path("file"), *out, "--path", self.path("file"))
        self.expect_refused(self.path("empty"), *out, "--path", self.path("empty"))
        self.expect_refused(self.path("file", "out"), "--output", self.path("file", "out"))
        self.expect_refused(self.path("none", "x.bag"), *out, "--bag", self.path("none", "x.bag"))


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "simulate_sequence", SimulateSequence, sysargs=sys.argv)
