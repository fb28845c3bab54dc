#!/usr/bin/python3
"""What evaluate_trajectory prints, writes and exits with. PROGRAMS names the folder of the program."""
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

import rosunit

KEYS = [
    "frames_reference", "frames_matched", "scale", "position_rmse", "position_median", "position_max", "path_length",
    "position_rmse_percent", "rotation_median_deg", "rotation_max_deg", "relative_rotation_median_deg",
    "relative_direction_median_deg"
]


def helix(count, scale=1.0):
    """TUM lines of a camera on a helix that turns about z."""
    lines = []
    for i in range(count):
        t = 0.1 * i
        lines.append("%.9f %.9f %.9f %.9f 0 0 %.9f %.9f\n" % (1403715273.25 + t, scale * math.cos(t), scale * math.sin(t),
                                                         scale * t, math.sin(t / 2), math.cos(t / 2)))
    return "".join(lines)


class EvaluateTrajectory(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.reference = self.file("reference.txt", "# a comment\n" + helix(30))

    def file(self, name, content):
        path = os.path.join(self.folder.name, name)
        with open(path, "w") as f:
            f.write(content)
        return path

    def run_program(self, *arguments):
        program = os.path.join(os.environ["PROGRAMS"], "evaluate_trajectory")
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)

    def expect_refused(self, parts, *arguments):
        result = self.run_program(*arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)

    def test_another_scale_is_no_error(self):
        figures, plot = os.path.join(self.folder.name, "e.json"), os.path.join(self.folder.name, "e.png")
        result = self.run_program("--reference", self.reference, "--estimate", self.file("e.txt", helix(20, 0.5)), "--json",
                                  figures, "--plot", plot)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("20 matched, 30 in the reference", result.stdout)
        with open(figures) as f:
            error = json.load(f)
        self.assertEqual(list(error)[:len(KEYS)], KEYS)
        self.assertEqual(len(error["epochs"]), 1)
        self.assertEqual((error["frames_reference"], error["frames_matched"]), (30, 20))
        self.assertAlmostEqual(error["scale"], 2, places=6)
        self.assertAlmostEqual(error["path_length"], 19 * math.hypot(2 * math.sin(0.05), 0.1), places=6)
        for key in KEYS[3:6] + KEYS[7:]:
            self.assertAlmostEqual(error[key], 0, places=5, msg=key)
        with open(plot, "rb") as f:
            self.assertEqual(f.read(4), b"\x89PNG")

    def test_a_part_that_has_no_reference_is_told(self):
        whole = self.run_program("--reference", self.reference, "--estimate", self.file("e.txt", helix(30)))
        self.assertEqual(whole.stderr, "")
        half = self.run_program("--reference", self.file("half.txt", helix(15)), "--estimate", self.file("e.txt", helix(30)))
        self.assertEqual(half.returncode, 0, half.stderr)
        for words in ("15 of 30", "same clock"):
            self.assertIn(words, half.stderr)
        self.assertEqual(half.stderr.count("\n"), 1, half.stderr)

    def test_stamps_further_apart_than_allowed_do_not_match(self):
        late = self.file("late.txt", helix(20).replace("1403715", "1403716"))
        self.expect_refused(["0 of 20", "expected 3"], "--reference", self.reference, "--estimate", late)
        result = self.run_program("--reference", self.reference, "--estimate", late, "--max-difference", "1001")
        self.assertEqual(result.returncode, 2)  # all of them nearest to one frame
        self.assertIn("1 of 20", result.stderr)

    def test_bad_input_is_named_in_one_line(self):
        reference = ["--reference", self.reference]
        self.expect_refused(["--estimate"], *reference)
        self.expect_refused(["none.txt", "expected"], *reference, "--estimate", "none.txt")
        self.expect_refused(["bad.txt: line 3"], *reference, "--estimate", self.file("bad.txt", helix(2) + "1 2 3\n"))
        self.expect_refused(["2 of 2", "expected 3"], *reference, "--estimate", self.file("two.txt", helix(2)))
        self.expect_refused(["0 of 0"], *reference, "--estimate", self.file("empty.txt", ""))
        good = [*reference, "--estimate", self.reference]
        self.expect_refused(["/no/such/e.json"], *good, "--json", "/no/such/e.json")
        self.expect_refused(["e.xyz", ".png"], *good, "--plot", os.path.join(self.folder.name, "e.xyz"))
        self.expect_refused(["--max-difference"], *good, "--max-difference", "-1")
        self.expect_refused(["--max-difference", "nan"], *good, "--max-difference", "nan")
        self.expect_refused(["--nonsense"], *good, "--nonsense")
        both = os.path.join(self.folder.name, "a.png")
        self.expect_refused(["written twice, by --json and by --plot"], *good, "--json", both, "--plot", both)
        self.assertFalse(os.path.exists(both))

    def test_what_does_not_arrive_is_no_success(self):
        """A full disk, and a standard output that is closed: neither goes into a file that is opened."""
        figures = os.path.join(self.folder.name, "e.json")
        for redirection, reason in ((">/dev/full", "No space left"), (">&-", "standard output")):
            result = subprocess.run(["bash", "-c", 'exec "$0" "$@" ' + redirection,
                                     os.path.join(os.environ["PROGRAMS"], "evaluate_trajectory"), "--reference",
                                     self.reference, "--estimate", self.reference, "--json", figures],
                                    stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(result.returncode, 2, redirection)
            self.assertIn(reason, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)

    def figures_of(self, content, *options):
        figures = os.path.join(self.folder.name, "figures.json")
        result = self.run_program("--reference", self.reference, "--estimate", self.file("e.txt", content), "--json",
                                  figures, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(figures) as f:
            return json.load(f), result.stdout

    def test_a_scale_is_sought_unless_told_otherwise(self):
        self.assertAlmostEqual(self.figures_of(helix(30, 0.5))[0]["ate_rmse"], 0, places=6)
        error, said = self.figures_of(helix(30, 0.5), "--align", "se3")
        self.assertEqual((error["scale"], error["align"]), (1, "se3"))
        self.assertGreater(error["ate_rmse"], 0.1)
        self.assertIn("not sought", said)

    def test_relative_error_over_frames_and_metres(self):
        """A helix of which the estimate is 10 % too small, without a scale: each step is wrong by a tenth of itself."""
        step = math.hypot(2 * math.sin(0.05), 0.1)
        error, said = self.figures_of(helix(30, 0.9), "--align", "se3", "--delta", "1")
        self.assertEqual(error["rpe_pairs"], 29)
        self.assertAlmostEqual(error["rpe_translation_rmse"], 0.1 * step, places=6)
        self.assertAlmostEqual(error["rpe_rotation_rmse_deg"], 0, places=5)
        self.assertIn("over 1 frames", said)
        chord = math.hypot(2 * math.sin(0.5), 1)
        for delta, pairs in (("10", 20), ("%.6fm" % (9.5 * step), 20)):
            error, _ = self.figures_of(helix(30, 0.9), "--align", "se3", "--delta", delta)
            self.assertEqual(error["rpe_pairs"], pairs)
            self.assertAlmostEqual(error["rpe_translation_rmse"], 0.1 * chord, places=6)
        none, said = self.figures_of(helix(30, 0.9), "--delta", "100")
        self.assertEqual((none["rpe_pairs"], none["rpe_translation_rmse"], none["rpe_rotation_rmse_deg"]), (0, None, None))
        self.assertIn("over 100 frames: no pairs", said)
        for bad in ("", "0", "-1", "1.5", "x", "3km", "nan"):
            self.expect_refused(["--delta"], "--reference", self.reference, "--estimate", self.reference, "--delta=" + bad)

    def test_epochs_are_judged_apart(self):
        """Two maps with scales of their own: exact apart, nonsense together."""
        lines, other = helix(30).splitlines(True), helix(30, 3.0).splitlines(True)
        content = "".join(lines[:10]) + "# a new map begins (epoch 1): another origin and scale\n" + "".join(other[10:])
        error, said = self.figures_of(content, "--plot", os.path.join(self.folder.name, "e.png"))
        self.assertEqual([e["frames_matched"] for e in error["epochs"]], [10, 20])
        self.assertAlmostEqual(error["epochs"][0]["scale"], 1, places=6)
        self.assertAlmostEqual(error["epochs"][1]["scale"], 1 / 3, places=6)
        self.assertEqual(error["frames_matched"], 20)
        self.assertAlmostEqual(error["position_max"], 0, places=6)
        self.assertIn("map 2 of 2", said)
        one_of_them, _ = self.figures_of(content.replace("# a new map begins", "#"))
        self.assertGreater(one_of_them["position_max"], 0.1)
        short, said = self.figures_of("".join(lines[:2]) + "# a new map begins\n" + "".join(lines[2:]))
        self.assertIn("expected 3", short["epochs"][0]["problem"])
        self.assertEqual(short["frames_matched"], 28)

    def test_help(self):
        result = self.run_program("--help")
        self.assertEqual(result.returncode, 0)
        self.assertIn("--max-difference", result.stdout)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "evaluate_trajectory", EvaluateTrajectory, sysargs=sys.argv)
