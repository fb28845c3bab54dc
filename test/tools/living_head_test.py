#!/usr/bin/python3
"""A head above shoulders that do not turn with it, before a bright wall: tracked with the default parameters and nothing
given. PROGRAMS names the folder of the programs."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import rosunit


class LivingHead(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_program(self, name, *arguments):
        result = subprocess.run([os.path.join(os.environ["PROGRAMS"], name), *arguments], capture_output=True, text=True,
                                timeout=600)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_shoulders_and_wall_do_not_disturb(self):
        sequence, output = os.path.join(self.folder.name, "head"), os.path.join(self.folder.name, "out")
        errors = os.path.join(self.folder.name, "errors.json")
        self.run_program("simulate_sequence", "--output", sequence, "--frames", "60", "--shoulders", "still",
                         "--background", "wall", "--noise", "1", "--seed", "0", "--quiet")
        self.run_program("track_sequence", "--images", os.path.join(sequence, "images.txt"), "--camera",
                         os.path.join(sequence, "camera.yaml"), "--output", output, "--seed", "0", "--quiet")
        self.run_program("evaluate_trajectory", "--reference", os.path.join(sequence, "groundtruth.txt"), "--estimate",
                         os.path.join(output, "trajectory.txt"), "--json", errors)
        with open(os.path.join(output, "report.json")) as f:
            report = json.load(f)
        with open(errors) as f:
            found = json.load(f)
        self.assertTrue(report["confirmed"], report["warnings"])
        self.assertEqual(report["frames_posed"], 60)
        self.assertEqual(report["segmentation"]["method"], "motion")
        self.assertLess(found["rotation_median_deg"], 0.5)
        self.assertLess(found["position_rmse_percent"], 1)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "living_head", LivingHead, sysargs=sys.argv)
