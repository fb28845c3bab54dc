#!/usr/bin/python3
"""A recording of two places that have nothing in common. PROGRAMS names the folder of the programs."""
import os
import sys
import unittest

import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from track_sequence_runs import Runs, lines, report, rows, run_program  # noqa: E402

FRAMES = {"room": 40, "plane": 25}


class SeveralMaps(Runs):
    def simulated(self, scene, first_stamp):
        """The lines of its list of images, and of its truth."""
        folder = self.path(scene)
        result = run_program("simulate_sequence", "--output", folder, "--scene", scene, "--frames", str(FRAMES[scene]),
                             "--width", "320", "--height", "240", "--focal", "262", "--rate", "10", "--first-stamp",
                             str(first_stamp), "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        listed = [(stamp, os.path.join(folder, image)) for stamp, image in rows(folder, "images.txt")]
        return listed, lines(folder, "groundtruth.txt")

    def write(self, name, text):
        with open(self.path(name), "w") as file:
            file.write(text)
        return self.path(name)

    def test_each_place_has_a_map_of_its_own(self):
        room, room_truth = self.simulated("room", 1)
        plane, plane_truth = self.simulated("plane", 100)
        listed = self.write("list.txt", "".join("%s %s\n" % image for image in room + plane))
        output = self.path("out")
        # An earlier run with the same folder had more maps.
        os.makedirs(os.path.join(output, "map_3"))
        os.makedirs(os.path.join(output, "map_2"))
        for stale in ("map_2", "map_3"):
            self.write(os.path.join("out", stale, "trajectory.txt"), "1 0 0 0 0 0 0 1\n")
        result = run_program("track_sequence", "--quiet", "--images", listed, "--camera", self.path("room", "camera.yaml"),
                             "--output", output)
        self.assertEqual(result.returncode, 0, result.stderr)

        said = report(output)
        self.assertEqual(len(said["maps"]), 2)
        self.assertIn("The recording is in 2 maps", " ".join(said["warnings"]))
        self.assertFalse(os.path.exists(os.path.join(output, "map_3", "trajectory.txt")))
        live = [[]]
        for line in lines(output, "trajectory_live.txt"):
            if line.startswith("# a new map begins"):
                live.append([])
            else:
                live[-1].append(float(line.split()[0]) >= 100)
        self.assertGreaterEqual(len(live), 2)
        for of_plane in live:
            self.assertEqual(len(set(of_plane)), 1, "the line stands between the poses of two maps")
        for name, (images, truth) in {"": (room, room_truth), "map_2": (plane, plane_truth)}.items():
            stamps = [float(pose[0]) for pose in rows(output, name, "trajectory.txt")]
            expected = [float(stamp) for stamp, _ in images]
            self.assertLessEqual(set(stamps), set(expected), name)
            self.assertGreaterEqual(len(stamps), 0.9 * len(expected), name)
            self.assertGreater(len(rows(output, name, "colmap", "images.txt")), len(stamps), name)
            reference = self.write("truth.txt", "\n".join(truth) + "\n")
            error = self.error_of(reference, output, os.path.join(name, "trajectory.txt"))
            self.assertLess(error["position_rmse_percent"], 1, name)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "several_maps", SeveralMaps, sysargs=sys.argv)
