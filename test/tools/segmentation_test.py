#!/usr/bin/python3
"""A head that turns before a fixed camera and a background full of texture. PROGRAMS names the folder of the programs."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from mask_overlap import compare_masks  # noqa: E402

FRAMES = 50
LEAD_IN = 10  # images of the background alone


def run_program(name, *arguments):
    program = os.path.join(os.environ["PROGRAMS"], name)
    return subprocess.run([program, *arguments], capture_output=True, text=True,
                          timeout=300 * float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1")))


class Segmentation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.TemporaryDirectory()
        cls.sequence = os.path.join(cls.made.name, "head")
        result = run_program("simulate_sequence", "--output", cls.sequence, "--background", "textured", "--frames",
                             str(FRAMES), "--lead-in", str(LEAD_IN), "--width", "480", "--height", "360", "--noise", "1",
                             "--distortion", "-0.1,0.02,0,0,0", "--quiet")
        assert result.returncode == 0, result.stderr
        with open(os.path.join(cls.sequence, "images.txt")) as f:
            lines = f.readlines()
        cls.head = os.path.join(cls.sequence, "head.txt")
        with open(cls.head, "w") as f:
            f.writelines(lines[LEAD_IN:])

    @classmethod
    def tearDownClass(cls):
        cls.made.cleanup()

    def track(self, name, images, options, *arguments):
        """Exit status, report and output folder."""
        output = os.path.join(self.made.name, name)
        config = os.path.join(self.made.name, name + ".yaml")
        with open(config, "w") as f:
            f.write("segmentation: {%s}\n" % options)
        result = run_program("track_sequence", "--images", images, "--camera", os.path.join(self.sequence, "camera.yaml"),
                             "--output", output, "--config", config, "--quiet", *arguments)
        with open(os.path.join(output, "report.json")) as f:
            return result.returncode, json.load(f), output

    def expect_accurate(self, output):
        errors = os.path.join(output, "errors.json")
        result = run_program("evaluate_trajectory", "--reference", os.path.join(self.sequence, "groundtruth.txt"),
                             "--estimate", os.path.join(output, "trajectory.txt"), "--json", errors)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(errors) as f:
            found = json.load(f)
        self.assertEqual(found["frames_matched"], FRAMES)
        self.assertLess(found["rotation_median_deg"], 0.3)
        self.assertLess(found["position_rmse_percent"], 1)

    def mean_overlap(self, folder):
        masks = compare_masks(folder, os.path.join(self.sequence, "masks"))
        self.assertGreater(len(masks), FRAMES // 2)
        return masks.mean_overlap()

    def test_nothing_given_the_object_is_found_by_its_motion(self):
        masks = os.path.join(self.made.name, "masks_motion")
        status, report, output = self.track("motion", self.head, "method: auto", "--write-masks", masks, "--undistorted")
        self.assertEqual(status, 0, report["reason"])
        self.expect_accurate(output)
        self.assertEqual(report["segmentation"]["method"], "motion")
        self.assertTrue(0.1 < report["segmentation"]["mean_foreground_share"] < 0.5)
        self.assertGreater(self.mean_overlap(masks), 0.75)
        self.expect_workspace(os.path.join(output, "undistorted"))

    def expect_workspace(self, folder):
        names = sorted(os.listdir(os.path.join(folder, "images")))
        self.assertEqual(len(names), FRAMES)
        self.assertEqual(sorted(os.listdir(os.path.join(folder, "masks"))), [name + ".png" for name in names])
        with open(os.path.join(folder, "sparse", "cameras.txt")) as f:
            self.assertIn("PINHOLE 480 360", f.read())
        with open(os.path.join(folder, "sparse", "images.txt")) as f:
            self.assertIn(" " + names[0] + "\n", f.read())
        with open(os.path.join(folder, "stereo", "fusion.cfg")) as f:
            self.assertEqual(f.read().split(), names)

    def test_a_background_is_learnt_while_the_head_is_away(self):
        masks = os.path.join(self.made.name, "masks_background")
        status, report, output = self.track("background", os.path.join(self.sequence, "images.txt"),
                                            "method: background, learning_frames: %d" % LEAD_IN, "--write-masks", masks)
        self.assertEqual(status, 0, report["reason"])
        self.expect_accurate(output)
        self.assertGreater(self.mean_overlap(masks), 0.9)

    def test_without_segmentation_it_says_that_the_background_stands_still(self):
        status, report, _ = self.track("none", self.head, "method: none")
        self.assertEqual(status, 1)
        self.assertIn("are static", report["reason"])


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "segmentation", Segmentation, sys.argv)
