#!/usr/bin/python3
"""What pipeline_benchmark counts, writes, prints and exits with. PROGRAMS names the folder of the program."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

import rosunit

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
FRAMES = 20
SLOWNESS = float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))  # of this build: with a sanitizer 10


def run_program(name, *arguments):
    program = os.path.join(os.environ["PROGRAMS"], name)
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=300 * SLOWNESS)


class PipelineBenchmark(unittest.TestCase):
    """A small simulated room, measured once."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        room = cls.path("room")
        made = run_program("simulate_sequence", "--output", room, "--scene", "room", "--frames", str(FRAMES), "--width",
                           "320", "--height", "240", "--noise", "1", "--rate", "10", "--quiet")
        assert made.returncode == 0, made.stderr
        cls.input = ["--images", os.path.join(room, "images.txt"), "--camera", os.path.join(room, "camera.yaml")]
        cls.reference = os.path.join(room, "groundtruth.txt")
        cls.json = cls.path("result.json")
        cls.result = run_program("pipeline_benchmark", *cls.input, "--reference", cls.reference, "--rate", "20", "--json",
                                 cls.json)
        assert cls.result.returncode == 0, cls.result.stderr
        cls.figures = cls.read(cls.json)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, *parts):
        return os.path.join(cls.folder.name, *parts)

    @staticmethod
    def read(path):
        with open(path) as f:
            return json.load(f)

    def expect_refused(self, part, *arguments):
        result = run_program("pipeline_benchmark", *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(part, result.stderr)

    def expect_times(self, times, count):
        self.assertEqual(set(times), {"median_ms", "p95_ms", "max_ms", "count"})
        self.assertEqual(times["count"], count)
        self.assertLessEqual(times["median_ms"], times["p95_ms"])
        self.assertLessEqual(times["p95_ms"], times["max_ms"])

    def test_offline_uses_every_frame(self):
        offline = self.figures["offline"]
        self.assertEqual(offline["frames_total"], FRAMES)
        self.assertEqual(offline["frames_posed"], FRAMES)
        self.assertEqual(offline["frames_not_posed"], 0)
        self.assertNotIn("frames_dropped", offline)
        self.expect_times(offline["frame"], FRAMES)
        self.expect_times(offline["stages"]["features"], FRAMES)
        self.assertGreaterEqual(1000 * offline["cpu_seconds"], offline["stages"]["features"]["median_ms"] * FRAMES / 2)
        self.assertLess(offline["position_rmse_percent"], 1)
        self.assertGreaterEqual(offline["memory_mb"]["peak"], offline["memory_mb"]["before"])

    def test_live_every_frame_is_registered_or_accounted_for(self):
        live = self.figures["live"]
        self.assertEqual(live["frames_total"], FRAMES)
        self.assertEqual(live["frames_posed"] + live["frames_not_posed"] + live["frames_dropped"], FRAMES)
        tracked = FRAMES - live["frames_dropped"]
        self.expect_times(live["latency"], tracked)
        self.expect_times(live["frame"], tracked)
        self.assertGreaterEqual(live["latency"]["median_ms"], live["frame"]["median_ms"])
        self.assertEqual(live["rate_hz"], 20)
        # The camera does not wait: the last image comes this long after the first.
        self.assertGreaterEqual(live["seconds"], (FRAMES - 1) / 20)

    def test_live_poses_are_compared_with_the_offline_ones(self):
        doubt = self.figures["live"]["doubt"]
        self.assertEqual(set(doubt), {"poses_compared", "poses_off", "poses_off_doubtful", "poses_doubtful"})
        self.assertLessEqual(doubt["poses_compared"], self.figures["live"]["frames_posed"])
        self.assertLessEqual(doubt["poses_off"], doubt["poses_compared"])
        self.assertLessEqual(doubt["poses_off_doubtful"], min(doubt["poses_off"], doubt["poses_doubtful"]))

    def test_live_the_final_map_is_compared_with_the_offline_result(self):
        live = self.figures["live"]
        self.assertIn("position_rmse_percent_on_final_map", live)
        if len(live["maps"]) == 1:  # on a busy machine another may just have begun
            self.assertLess(live["position_rmse_percent_on_final_map"], 2)
            self.assertGreater(live["position_percent_from_offline"], 0)
            self.assertLess(live["position_percent_from_offline"], 2)

    def test_live_each_map_is_measured_by_itself(self):
        live = self.figures["live"]
        self.assertEqual(sum(m["frames"] for m in live["maps"]), live["frames_posed"])
        self.assertEqual(sum(live["reasons"].values()), FRAMES - live["frames_dropped"])
        largest = max(live["maps"], key=lambda m: m["frames"])
        self.assertLess(largest["position_rmse_percent"], 5)
        # Poses of two maps are no path.
        self.assertEqual(live["position_rmse_percent"], largest["position_rmse_percent"])
        self.assertEqual(live["frames_posed_in_other_maps"], live["frames_posed"] - largest["frames"])
        self.assertLess(largest["rotation_median_deg"], 3)

    def test_faster_than_it_can_be_frames_are_dropped_not_queued(self):
        result = run_program("pipeline_benchmark", *self.input, "--only", "live", "--rate", "1000", "--quiet", "--json",
                             self.path("fast.json"))
        self.assertEqual((result.returncode, result.stdout), (0, ""), result.stderr)
        live = self.read(self.path("fast.json"))["live"]
        self.assertGreater(live["frames_dropped"], 0)
        self.assertNotIn("doubt", live, "nothing to compare with")
        self.assertEqual(live["frames_posed"] + live["frames_not_posed"] + live["frames_dropped"], FRAMES)

    def test_the_table_says_what_the_file_says(self):
        for title, key in (("registered", "frames_posed"), ("dropped", "frames_dropped"), ("landmarks", "landmarks")):
            row = re.search(r"^ *%s +(\S+) +(\S+)$" % title, self.result.stdout, re.MULTILINE)
            self.assertIsNotNone(row, self.result.stdout)
            for shown, run in zip(row.groups(), ("offline", "live")):
                self.assertEqual(shown, str(self.figures[run].get(key, "-")))

    def test_ratios_to_an_earlier_run(self):
        earlier = json.loads(json.dumps(self.figures))
        earlier["offline"]["landmarks"] *= 2
        del earlier["offline"]["keyframes"]
        with open(self.path("earlier.json"), "w") as f:
            json.dump(earlier, f)
        result = run_program("pipeline_benchmark", *self.input, "--only", "offline", "--quiet", "--compare",
                             self.path("earlier.json"))
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = [line.split() for line in result.stdout.splitlines()]
        table = {row[0]: row[1:] for row in rows if row and "/" in row[0]}
        # Offline runs repeat exactly.
        points = self.figures["offline"]["landmarks"]
        self.assertEqual(table["offline/landmarks"], [str(2 * points), str(points), "0.500"])
        self.assertEqual(table["offline/frames_posed"], ["20", "20", "1.000"])
        self.assertIn("offline/frame/median_ms", table)
        self.assertNotIn("offline/keyframes", table)
        self.assertFalse([row for row in table if row.startswith("live")])

    def test_of_several_runs_the_middle_one_is_given(self):
        result = run_program("pipeline_benchmark", *self.input, "--only", "offline", "--max-frames", "5", "--repeat", "3",
                             "--quiet", "--json", self.path("three.json"))
        self.assertEqual(result.returncode, 0, result.stderr)
        offline = self.read(self.path("three.json"))["offline"]
        medians = offline["median_ms_of_runs"]
        self.assertEqual(len(medians), 3)
        self.assertEqual(medians, sorted(medians))
        self.assertEqual(offline["frame"]["median_ms"], medians[1])
        self.assertEqual(offline["frames_total"], 5)

    def test_a_simulated_run_minute_by_minute(self):
        # Three minutes of two frames a second.
        result = run_program("pipeline_benchmark", "--simulate", "room", "--minutes", "3", "--rate", "2", "--unpaced",
                             "--width", "120", "--height", "90", "--json", self.path("soak.json"))
        self.assertEqual(result.returncode, 0, result.stderr)
        soak = self.read(self.path("soak.json"))["soak"]
        self.assertEqual([minute["minute"] for minute in soak["minutes"]], [1, 2, 3])
        for minute in soak["minutes"]:
            self.assertEqual(minute["frames_total"], 120)
            self.assertEqual(minute["frames_posed"] + minute["frames_not_posed"], 120)
            self.assertEqual(minute["frames_dropped"], 0)
            self.expect_times(minute["frame"], 120)
        second, last = soak["minutes"][1], soak["minutes"][2]
        ratios = soak["last_to_second"]
        self.assertAlmostEqual(ratios["frame/median_ms"], last["frame"]["median_ms"] / second["frame"]["median_ms"])
        self.assertAlmostEqual(ratios["memory_mb"], last["memory_mb"] / second["memory_mb"])
        self.assertIn("frame/median_ms", result.stdout)

    def slow_room(self):
        """The room's images once more, ten seconds apart: none is barred as a neighbour in time."""
        folder = self.path("slow_room")
        os.makedirs(folder)
        with open(self.input[1]) as source, open(os.path.join(folder, "images.txt"), "w") as images:
            lines = [line.split() for line in source if not line.startswith("#")]
            for i, (_, name) in enumerate(lines):
                images.write(f"{10 * i} {os.path.join(os.path.dirname(self.input[1]), name)}\n")
        with open(self.reference) as source, open(os.path.join(folder, "groundtruth.txt"), "w") as truth:
            poses = [line.split() for line in source if not line.startswith("#")]
            truth.writelines(f"{10 * i} {' '.join(pose[1:])}\n" for i, pose in enumerate(poses))
        os.symlink(self.input[3], os.path.join(folder, "camera.yaml"))
        return folder

    def test_the_places_that_brute_force_finds_are_found(self):
        written = self.path("places.json")
        result = run_program("pipeline_benchmark", "--places", self.slow_room(), "--place-keyframes", "60", "--json", written)
        self.assertEqual(result.returncode, 0, result.stderr)
        places = self.read(written)["places"]
        room = places["sequences"]["slow_room"]
        self.assertEqual((room["keyframes"], room["queries"]), (FRAMES // 2, FRAMES // 2))
        self.assertEqual(room["brute_force"], FRAMES // 2)
        self.assertEqual(room["best_5"], room["brute_force"])
        self.assertEqual(places["recall_5"], 1)
        self.assertEqual(places["keyframes"], 60)
        self.expect_times(places["add_ms"], 60)
        self.expect_times(places["query_ms"], FRAMES // 2)
        self.assertIn("recall of the best 5: 100.0 %", result.stdout)

    def draw(self, *results):
        script = os.path.join(ROOT, "scripts", "plot_costs")
        return subprocess.run([script, *results, "--output", self.path("costs.png")], capture_output=True, text=True,
                              timeout=60 * SLOWNESS)

    def test_costs_are_drawn_against_the_size_of_the_images(self):
        larger = {**self.figures, "width": 640, "height": 480}
        with open(self.path("larger.json"), "w") as file:
            json.dump(larger, file)
        result = self.draw(self.json, self.path("larger.json"))
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertGreater(os.path.getsize(self.path("costs.png")), 10000)

    def test_costs_are_drawn_against_the_keyframes_of_the_map(self):
        written, earlier = self.path("growth.json"), self.path("earlier_growth.json")
        with open(earlier, "w") as file:
            json.dump({"program": "pipeline_benchmark", "growth": {"street": {"steps": [{"landmarks": 1}]}}}, file)
        result = run_program("pipeline_benchmark", "--growth", "100", "--json", written, "--compare", earlier)
        self.assertEqual(result.returncode, 0, result.stderr)
        landmarks = self.read(written)["growth"]["street"]["steps"][0]["landmarks"]
        ratio = r"growth/street/steps/0/landmarks +1 +%d +%d\.000" % (landmarks, landmarks)
        self.assertRegex(result.stdout, ratio)
        result = self.draw(written)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertGreater(os.path.getsize(self.path("costs.png")), 10000)

    def test_what_is_not_of_the_benchmark_is_not_drawn(self):
        for path in ("/nowhere", self.reference):
            result = self.draw(path)
            self.assertEqual(result.returncode, 1)
            self.assertIn(path, result.stderr)

    def test_refusals_name_what_is_wrong(self):
        images, camera = self.input[:2], self.input[2:]
        self.expect_refused("--images", *camera)
        self.expect_refused("--camera", *images)
        self.expect_refused("/nowhere", "--images", "/nowhere", *camera)
        self.expect_refused("/nowhere", *images, "--camera", "/nowhere")
        self.expect_refused("/nowhere", *self.input, "--compare", "/nowhere")
        self.expect_refused(self.reference, *self.input, "--compare", self.reference)
        self.expect_refused("/nowhere", *self.input, "--reference", "/nowhere")
        self.expect_refused("/nowhere", *self.input, "--config", "/nowhere")
        self.expect_refused("--rate", *self.input, "--rate", "0")
        with open(self.path("small.yaml"), "w") as file:
            file.write("mapping:\n  max_keyframes: 9\n")
        for run in self.input, ["--simulate", "room", "--minutes", "0.01"]:
            self.expect_refused("mapping/max_keyframes", *run, "--config", self.path("small.yaml"))
        self.expect_refused("--only", *self.input, "--only", "both")
        self.expect_refused("--repeat", *self.input, "--repeat", "0")
        self.expect_refused("--simulate", *self.input, "--simulate", "room")
        self.expect_refused("--simulate", "--simulate", "attic")
        self.expect_refused("/nowhere", "--places", "/nowhere")
        self.expect_refused("--places", "--places", "/nowhere", *images)
        self.expect_refused("--minutes", "--simulate", "room", "--minutes", "0")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "pipeline_benchmark", PipelineBenchmark, sysargs=sys.argv)
