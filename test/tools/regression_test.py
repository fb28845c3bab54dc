#!/usr/bin/python3
"""scripts/regression: what its gates let pass, and its short form on the recordings that MONO_POSE_TRACKER_DATA names.
PROGRAMS names the folder of the programs."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = REPOSITORY / "scripts" / "regression"
DATA = os.environ.get("MONO_POSE_TRACKER_DATA", "")
SLOWNESS = float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))

WALK = {"name": "walk", "folder": "walk", "verdict": "confirmed", "reason": "A test.",
        "floor": {"registered": 95, "rotation_deg": 1.0, "position_percent": 1.0}}
STILL = {"name": "still", "folder": "still", "verdict": "no_map", "reason": "A test."}
# Programs: the first copies the truth, or ends as the name of the first image asks for.
TRACKER = """#!/usr/bin/python3
import json, os, shutil, signal, sys, time
value = lambda key: sys.argv[sys.argv.index(key) + 1]
images, output = value("--images"), value("--output")
lines = open(images).read().splitlines()
if "fail" in lines[1]:
    sys.exit("images/fail.png: no such file")
if "crash" in lines[1]:
    os.kill(os.getpid(), signal.SIGSEGV)
if "wait" in lines[1]:
    with open(os.path.join(output, "part"), "w") as started:
        started.write(str(os.getpid()))
    os.rename(os.path.join(output, "part"), os.path.join(output, "started"))
    time.sleep(100)
shutil.copy(os.path.join(os.path.dirname(images), "groundtruth.txt"), os.path.join(output, "trajectory.txt"))
json.dump({"tracked": True, "confirmed": True, "frames_total": len(lines), "maps": [{"frames": len(lines)}], "warnings": [],
           "stages": {"features": {"median_ms": 1, "p95_ms": 1, "max_ms": 1, "count": 2 * len(lines)}}},
          open(os.path.join(output, "report.json"), "w"))
"""
EVALUATION = """#!/usr/bin/python3
import json, sys
json.dump({"rotation_median_deg": 0.1, "rotation_max_deg": 0.2, "position_rmse_percent": 0.3},
          open(sys.argv[sys.argv.index("--json") + 1], "w"))
"""


def walked(seed=0, **changes):
    """A run as results.json has it."""
    run = {"name": "walk", "seed": seed, "status": 0, "tracked": True, "confirmed": True, "frames": 100, "registered": 100,
           "maps": 1, "warnings": 0, "rotation_deg": 0.5, "rotation_max_deg": 0.7, "position_percent": 0.5, "cpu_seconds": 20.0,
           "wall_seconds": 10.0, "tracking_seconds": 5.0, "peak_memory_mb": 200.0, "trajectory_sha256": "a", "points_sha256": "b"}
    return {**run, **changes}


class InFolder(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)

    def write_floors(self, *entries):
        path = self.folder / "floors.yaml"
        path.write_text(yaml.safe_dump({"sequences": list(entries)}))
        return path

    def regression(self, *arguments, data=""):
        """Exit status, the lines of what it printed, what it said of errors."""
        done = subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                              env={**os.environ, "MONO_POSE_TRACKER_DATA": data})
        return done.returncode, done.stdout.splitlines(), done.stderr


class Gates(InFolder):
    def judge(self, runs, baseline=None, floors=(WALK, STILL), options=()):
        """Exit status and the lines that name a failure."""
        for name, results in (("now", runs), ("before", baseline)):
            if results is not None:
                (self.folder / name).mkdir(exist_ok=True)
                (self.folder / name / "results.json").write_text(json.dumps(results))
        compared = [] if baseline is None else ["--baseline", self.folder / "before"]
        status, self.lines, said = self.regression(self.folder / "now", "--no-run", "--floors", self.write_floors(*floors),
                                                   *compared, *options)
        self.assertNotEqual(status, 2, said)
        return status, [line for line in self.lines if line.startswith("FAILED ")]

    def expect_failure(self, part, *arguments, **options):
        status, failures = self.judge(*arguments, **options)
        self.assertEqual((status, len(failures)), (1, 1), failures)
        self.assertIn(part, failures[0])

    def test_equal_results_pass(self):
        runs = [walked(seed) for seed in range(5)]
        self.assertEqual(self.judge(runs, runs), (0, []))
        self.assertIn("identical to the baseline: 5 of 5 runs", self.lines)
        self.assertEqual(self.lines[-1], "5 runs, 0 failures")

    def test_the_table_has_the_worst_of_the_seeds(self):
        self.judge([walked(0), walked(1, registered=97, position_percent=0.625, confirmed=False, maps=2)])
        header, row = ([cell.strip() for cell in line.split("|")[1:-1]] for line in self.lines[1:4:2])
        cells = dict(zip(header, row))
        self.assertEqual((cells["sequence"], cells["confirmed"], cells["registered"], cells["%"], cells["maps"], cells["run/tracking"]),
                         ("walk", "1", "97 to 100 of 100", "0.6250", "2", "2.0"))

    def test_fewer_registered_images_than_the_baseline_fail(self):
        self.assertEqual(self.judge([walked(registered=99)], [walked()])[0], 0, "1 % is tolerated")
        self.expect_failure("98 images registered, baseline 100", [walked(registered=98)], [walked()])
        self.assertEqual(self.judge([walked(registered=98)], [walked(), walked(1, registered=98)])[0], 0)

    def test_a_larger_error_than_the_baseline_fails(self):
        self.assertEqual(self.judge([walked(position_percent=0.545)], [walked()])[0], 0)
        self.expect_failure("position error 0.6 %, baseline 0.5", [walked(position_percent=0.6)], [walked()])
        self.expect_failure("rotation error 0.6 deg, baseline 0.5", [walked(rotation_deg=0.6)], [walked()])
        self.assertEqual(self.judge([walked(position_percent=0.6)], [walked(), walked(1, position_percent=0.55)])[0], 0,
                         "the worst seed counts")

    def test_below_the_accuracy_of_the_truth_errors_are_not_compared(self):
        floors = [{**WALK, "truth_accuracy": {"position_percent": 0.65}}]
        self.assertEqual(self.judge([walked(position_percent=0.6)], [walked()], floors)[0], 0)
        self.expect_failure("allowed 0.65", [walked(position_percent=0.7)], [walked()], floors=floors)

    def test_errors_of_more_images_are_held_to_the_floor_alone(self):
        self.assertEqual(self.judge([walked(position_percent=0.9)], [walked(registered=70, position_percent=0.1)])[0], 0)
        self.expect_failure("floor 1", [walked(position_percent=1.2)], [walked(registered=70, position_percent=0.1)])

    def test_a_missed_floor_fails(self):
        self.expect_failure("94 images registered, floor 95", [walked(registered=94)])
        self.expect_failure("rotation error 1.2 deg, floor 1", [walked(rotation_deg=1.2)])
        lost = walked(tracked=False, confirmed=False, registered=0)
        del lost["rotation_deg"], lost["position_percent"]
        self.assertEqual(len(self.judge([lost])[1]), 3)

    def test_a_wrong_result_that_is_confirmed_fails(self):
        free = {"name": "walk", "folder": "walk", "verdict": "any", "reason": "A test."}
        self.expect_failure("wrong and confirmed: position error 3.1 %", [walked(position_percent=3.1)], floors=[free])
        self.expect_failure("wrong and confirmed: rotation error 3.1 deg", [walked(rotation_deg=3.1)], floors=[free])
        self.assertEqual(self.judge([walked(position_percent=3.1, confirmed=False)], floors=[free])[0], 0)
        self.expect_failure("wrong and confirmed", [walked(position_percent=3.1)], floors=[])

    def test_a_result_within_its_floor_has_to_be_confirmed(self):
        self.expect_failure("within its floor and not confirmed", [walked(confirmed=False)])

    def test_a_map_where_there_can_be_none_fails(self):
        still = walked(name="still", tracked=False, confirmed=False, registered=0, maps=0)
        self.assertEqual(self.judge([still])[0], 0)
        self.expect_failure("expected no map", [walked(name="still", confirmed=False)])

    def test_a_crash_fails_in_one_line(self):
        crashed = {"name": "walk", "seed": 0, "crashed": "track_sequence: ended by SIGSEGV"}
        self.expect_failure("walk seed 0: track_sequence: ended by SIGSEGV", [crashed])
        self.expect_failure("SIGSEGV", [crashed], [crashed], options=["--allow-known"])

    def test_known_failures_can_be_allowed(self):
        doubted, wrong = walked(confirmed=False), walked(position_percent=6.0)
        self.expect_failure("not confirmed", [doubted], [doubted])
        self.assertEqual(self.judge([doubted], [doubted], options=["--allow-known"])[0], 0)
        self.assertEqual(self.lines[-1], "1 runs, 0 failures, 1 as in the baseline")
        self.assertEqual(self.judge([doubted], [walked()], options=["--allow-known"])[0], 1)
        self.assertEqual(self.judge([wrong], [doubted], options=["--allow-known"])[0], 1)

    def test_the_same_bytes_can_be_asked_for(self):
        other = walked(points_sha256="c")
        self.assertEqual(self.judge([other], [walked()])[0], 0)
        self.expect_failure("points.ply", [other], [walked()], options=["--identical"])

    def test_time_is_no_failure(self):
        self.assertEqual(self.judge([walked(cpu_seconds=60.0)], [walked()])[0], 0)
        self.assertIn("CPU time of 1 runs: 60.0 s, baseline 20.0 s, ratio 3.000", self.lines)


class RunsOfPrograms(InFolder):
    def setUp(self):
        super().setUp()
        self.programs, self.data, self.output = (self.folder / name for name in ("programs", "data", "out"))
        self.programs.mkdir()
        for name, text in (("track_sequence", TRACKER), ("evaluate_trajectory", EVALUATION), ("simulate_sequence", EVALUATION)):
            (self.programs / name).write_text(text)
            (self.programs / name).chmod(0o755)

    def write_recording(self, name, image="{:02d}.png"):
        folder = self.data / name
        folder.mkdir(parents=True)
        (folder / "camera.yaml").write_text("image_width: 4\nimage_height: 2\n")
        (folder / "images.txt").write_text("# stamp image\n" + "".join(f"{i}.5 {image.format(i)}\n" for i in range(10)))
        (folder / "groundtruth.txt").write_text("".join(f"{i}.5 {i} 0 0 0 0 0 1\n" for i in range(10)))

    def track(self, floors, *options):
        return self.regression(self.output, "--data", self.data, "--floors", self.write_floors(*floors), "--program-folder",
                               self.programs, *options)

    def results(self):
        return json.loads((self.output / "results.json").read_text())

    def test_every_recording_is_run_with_every_seed(self):
        self.write_recording("walk")
        self.write_recording("without_floor")
        floors = [{**WALK, "floor": {"registered": 10}}, {**WALK, "name": "elsewhere", "folder": "elsewhere"}]
        status, lines, said = self.track(floors, "--seeds", "0,3", "--jobs", "2")
        self.assertEqual(status, 0, said)
        self.assertIn("recordings that are not present: elsewhere", lines)
        runs = self.results()
        self.assertEqual([(run["name"], run["seed"]) for run in runs],
                         [("walk", 0), ("walk", 3), ("without_floor", 0), ("without_floor", 3)])
        self.assertEqual((runs[0]["registered"], runs[0]["position_percent"], runs[0]["threads"]), (10, 0.3, 1))
        self.assertGreater(runs[0]["cpu_seconds"], 0)
        self.assertGreater(runs[0]["peak_memory_mb"], 1)

    def test_results_are_kept_and_gone_on_with(self):
        self.write_recording("walk")
        floors = [{**WALK, "floor": {"registered": 10}}]
        self.assertEqual(self.track(floors, "--seeds", "0")[0], 0)
        status, _, said = self.track(floors, "--seeds", "0,1")
        self.assertEqual(status, 2)
        self.assertIn("--resume", said)
        record = self.output / "walk" / "seed_0" / "run.json"
        written = record.stat().st_mtime_ns
        self.assertEqual(self.track(floors, "--seeds", "0,1", "--resume")[0], 0)
        self.assertEqual(record.stat().st_mtime_ns, written)
        self.assertEqual([run["seed"] for run in self.results()], [0, 1])

    def test_parts_are_played_with_the_truth_of_the_images_shown(self):
        self.write_recording("walk")
        played = {"name": "played", "folder": "walk", "play": [":2", "9:6:-1"], "black": ["8:9"], "verdict": "any", "reason": "A test."}
        self.assertEqual(self.track([played], "--seeds", "0", "--only", "played")[0], 0)
        folder = self.output / "inputs" / "played"
        shown = [line.split() for line in (folder / "images.txt").read_text().splitlines()]
        self.assertEqual([(stamp, os.path.basename(path)) for stamp, path in shown],
                         [("0.5", "00.png"), ("1.5", "01.png"), ("7.5", "09.png"), ("8.5", "black.pgm"), ("9.5", "07.png")])
        truth = [line.split()[:2] for line in (folder / "groundtruth.txt").read_text().splitlines()]
        self.assertEqual(truth, [["0.5", "0"], ["1.5", "1"], ["7.5", "9"], ["9.5", "7"]])

    def test_images_are_blurred(self):
        self.write_recording("walk")
        sharp = numpy.zeros((60, 80), numpy.uint8)
        sharp[:, 40:] = 255
        cv2.imwrite(str(self.data / "walk" / "01.png"), sharp)
        entry = {"name": "soft", "folder": "walk", "play": [":3"], "blurred": ["1:2"], "verdict": "any", "reason": "A test."}
        self.assertEqual(self.track([entry], "--seeds", "0", "--only", "soft")[0], 0)
        folder = self.output / "inputs" / "soft"
        shown = [line.split()[1] for line in (folder / "images.txt").read_text().splitlines()]
        self.assertEqual(shown[::2], [str(self.data / "walk" / name) for name in ("00.png", "02.png")])
        self.assertEqual(shown[1], str(folder / "01.png"))
        steps = numpy.diff(cv2.imread(shown[1], cv2.IMREAD_GRAYSCALE)[30].astype(int))
        self.assertTrue(0 < steps.max() < 40, steps)
        self.assertEqual(len((folder / "groundtruth.txt").read_text().splitlines()), 3)

    def test_a_program_that_fails_is_named(self):
        self.write_recording("crashing", "crash.png")
        self.write_recording("failing", "fail.png")
        status, lines, _ = self.track([], "--seeds", "0")
        self.assertEqual(status, 1)
        self.assertIn("FAILED crashing seed 0: track_sequence: ended by SIGSEGV", lines)
        failing = [line for line in lines if line.startswith("FAILED failing")]
        self.assertEqual(failing, ["FAILED failing seed 0: track_sequence: exit status 1: images/fail.png: no such file"])

    def test_an_interrupted_run_ends_its_programs_and_leaves_no_result(self):
        self.write_recording("waiting", "wait.png")
        process = subprocess.Popen([sys.executable, str(SCRIPT), str(self.output), "--data", str(self.data), "--floors",
                                    str(self.write_floors()), "--program-folder", str(self.programs), "--seeds", "0,1"],
                                   stderr=subprocess.PIPE, text=True)
        started = self.output / "waiting" / "seed_0" / "started"
        deadline = time.monotonic() + 60
        while not started.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        process.terminate()
        _, said = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertIn("--resume", said)
        self.assertEqual([path.name for path in self.output.glob("*/*/run.json")], [])
        with self.assertRaises(ProcessLookupError):
            os.kill(int(started.read_text()), 0)

    def test_wrong_arguments_are_told_in_a_line(self):
        self.write_recording("walk")
        for floors, options, part in (([{**WALK, "flor": {}}], (), "unknown key 'flor'"),
                                      ([{**WALK, "verdict": "right"}], (), "verdict 'right'"),
                                      ([WALK], ("--program-folder", self.folder), "build first"),
                                      ([WALK], ("--only", "nothing"), "no sequence matches"),
                                      ([WALK], ("--data", "/no/such/folder"), "/no/such/folder"),
                                      ([WALK], ("--baseline", self.folder), "results.json")):
            status, _, said = self.track(floors, *options)
            self.assertEqual(status, 2, part)
            self.assertIn(part, said)


class Floors(unittest.TestCase):
    def test_floors_are_complete(self):
        """What the gates need of each entry. The short form has sequences that need no recordings."""
        with open(REPOSITORY / "test" / "regression" / "floors.yaml", encoding="utf-8") as file:
            entries = yaml.safe_load(file)["sequences"]
        for entry in entries:
            self.assertTrue(entry["reason"].endswith("."), entry["name"])
            if entry["verdict"] == "confirmed" and "folder" in entry:
                self.assertLessEqual({"registered", "rotation_deg", "position_percent"}, set(entry["floor"]), entry["name"])
        self.assertTrue(any(e.get("short") and "simulate" in e for e in entries))


@unittest.skipUnless(DATA, "MONO_POSE_TRACKER_DATA names no folder of real sequences")
class ShortForm(InFolder):
    def test_real_and_simulated_sequences_reach_their_floors(self):
        status, lines, said = self.regression(self.folder / "out", "--short", "--program-folder", os.environ["PROGRAMS"],
                                              "--timeout", 300 * SLOWNESS, data=DATA)
        self.assertEqual(status, 0, "\n".join(lines) + said)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "regression", "__main__", sysargs=sys.argv)
