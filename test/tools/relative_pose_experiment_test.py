#!/usr/bin/python3
"""What relative_pose_experiment writes and exits with. PROGRAMS names the folder of the program."""
import csv
import os
import subprocess
import sys
import tempfile
import unittest

import rosunit


class RelativePoseExperiment(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_program(self, name, *arguments):
        program = os.path.join(os.environ["PROGRAMS"], "relative_pose_experiment")
        output = os.path.join(self.folder.name, name)
        result = subprocess.run([program, "--output", output, *arguments], capture_output=True, text=True, timeout=120)
        return result, os.path.join(output, "errors.csv")

    def errors(self, name, *arguments):
        result, path = self.run_program(name, "--trials", "200", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(path, newline="") as file:
            return {(r["solver"], float(r["depth_by_width"]), float(r["noise_px"])): r for r in csv.DictReader(file)}

    def test_errors_grow_with_noise_from_nothing(self):
        rows = self.errors("default")
        self.assertEqual(len(rows), 2 * 3 * 9)
        for solver in ("5-point", "7-point"):
            for scene in (0.01, 0.1, 1.0):
                median = [float(rows[solver, scene, 0.25 * i]["rotation_median_deg"]) for i in range(9)]
                self.assertLess(median[0], 1e-6)
                self.assertGreater(median[8], median[1])
        # A plane is degenerate for seven points, not for five.
        key = (0.01, 0.25)
        self.assertLess(float(rows[("5-point", *key)]["translation_median_deg"]), 5)
        self.assertGreater(float(rows[("7-point", *key)]["translation_median_deg"]), 20)

    def test_result_depends_on_the_seed_and_not_on_the_threads(self):
        one = self.errors("one", "--threads", "1", "--seed", "3")
        self.assertEqual(one, self.errors("three", "--threads", "3", "--seed", "3"))
        self.assertNotEqual(one, self.errors("other", "--seed", "4"))

    def test_cheirality_decides_on_the_almost_planar_scene(self):
        third_quartile = {
            choice: float(self.errors(choice, "--choice", choice)["5-point", 0.01, 0.25]["rotation_q3_deg"])
            for choice in ("cheirality", "sampson", "truth")
        }
        self.assertLessEqual(third_quartile["truth"], third_quartile["cheirality"])
        self.assertLess(third_quartile["cheirality"], 0.5 * third_quartile["sampson"])

    def test_bad_arguments(self):
        for arguments, named in ((("--choice", "luck"), "--choice"), (("--trials", "0"), "--trials")):
            result, _ = self.run_program("bad", *arguments)
            self.assertEqual(result.returncode, 2)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertIn(named, result.stderr)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "relative_pose_experiment", RelativePoseExperiment, sysargs=sys.argv)
