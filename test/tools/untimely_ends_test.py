#!/usr/bin/python3
"""What track_sequence leaves when it is interrupted, nobody listens or a file cannot be written. PROGRAMS names the folder
of the program."""
import math
import os
import signal
import subprocess
import sys
import time

import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import FRAMES, RunsOfARoom, content, lines, report, rows, run_program  # noqa: E402


def is_caught(pid, number):
    """Whether the process has a handler for the signal."""
    with open(f"/proc/{pid}/status") as status:
        mask = next(int(line.split()[1], 16) for line in status if line.startswith("SigCgt"))
    return bool(mask >> (number - 1) & 1)


class UntimelyEnds(RunsOfARoom):
    def interrupt(self, images, output, *camera):
        """What it says when it is interrupted at its 50th image."""
        program = os.path.join(os.environ["PROGRAMS"], "track_sequence")
        process = subprocess.Popen([program, "--images", images, "--output", output, *(camera or ("--camera", self.camera))],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for line in process.stderr:  # a line for every change of state and for every 50 images
            if "image 50:" in line:
                process.send_signal(signal.SIGINT)
                break
        said = process.communicate(timeout=300)[1]
        self.assertEqual(process.returncode, 128 + signal.SIGINT, said)
        return said

    def test_an_interrupted_run_writes_what_there_is(self):
        output = self.path("interrupted")
        # Long enough that it cannot end by itself before it is told to.
        said = self.interrupt(self.list_of(self.names + 30 * (self.names[::-1] + self.names)), output)
        self.assertIn("interrupted after", said)
        figures = report(output)
        self.assertTrue(any("interrupted after" in warning for warning in figures["warnings"]), figures["warnings"])
        self.assertLess(figures["frames_total"], 50 + 200)
        self.assertGreater(len(rows(output, "trajectory.txt")), 40)

    def test_a_second_signal_of_either_kind_ends_it_at_once(self):
        program = os.path.join(os.environ["PROGRAMS"], "track_sequence")
        for first, second in ((signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT)):
            process = subprocess.Popen([program, "--images", self.list_of(self.names + 30 * (self.names[::-1] + self.names)),
                                        "--camera", self.camera, "--output", self.path("twice")],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            next(line for line in process.stderr if "image 50:" in line)
            process.send_signal(first)
            while is_caught(process.pid, second):  # until the first has been handled
                self.assertIsNone(process.poll(), "it ended by the first")
                time.sleep(0.001)
            process.send_signal(second)
            process.communicate(timeout=60)
            self.assertEqual(process.returncode, -second)

    def test_an_interrupted_refinement_leaves_what_its_run_came_to(self):
        """Its camera is a guess still, and no poses of an earlier run lie beside its own."""
        output, few = self.path("guessed"), self.names[:8]  # too few for the keyframes that the first run waits for
        os.mkdir(output)
        with open(os.path.join(output, "trajectory_live.txt"), "w") as f:
            f.write("999.000000000 0 0 0 0 0 0 1\n")
        fx = yaml.safe_load(content(self.camera))["camera_matrix"]["data"][0]
        said = self.interrupt(self.list_of(few + 60 * (few[::-1] + few)), output, "--hfov",
                              "%.3f" % math.degrees(2 * math.atan(160 / fx)))
        figures = report(output)
        self.assertEqual(figures["camera"]["runs"], 1, "or it was not interrupted in its first run")
        self.assertEqual((figures["calibration"], figures["confirmed"]), ("GUESSED", False))
        self.assertEqual(figures["camera"]["focal_length_sigma"], -1)
        self.assertIn("refinement of the camera was interrupted", said)
        live = rows(output, "trajectory_live.txt")
        self.assertGreater(len(live), 30)
        self.assertEqual(len(live), figures["frames_posed_live"])
        self.assertLess(max(float(pose[0]) for pose in live), 999)

    def test_interrupted_while_images_are_written(self):
        """Those of the dense workspace that are there are all that it names."""
        output, program = self.path("out"), os.path.join(os.environ["PROGRAMS"], "track_sequence")
        names = 6 * self.names
        process = subprocess.Popen([program, "--images", self.list_of(names), "--camera", self.camera, "--output", output,
                                    "--undistorted", "--quiet"], stderr=subprocess.PIPE, text=True)
        written = os.path.join(output, "undistorted", "images")
        while not (os.path.isdir(written) and os.listdir(written)):
            self.assertIsNone(process.poll())
            time.sleep(0.002)  # leaves the program its processor
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=300)[1]
        self.assertEqual(process.returncode, 128 + signal.SIGINT, said)
        self.assertIn("interrupted while files were written", said)
        self.assertIn("interrupted while files were written", " ".join(report(output)["warnings"]))
        self.assertGreater(len(rows(output, "trajectory.txt")), len(names) // 2)
        there = sorted(os.listdir(written))
        self.assertLess(len(there), len(names))
        self.assertEqual(sorted(lines(output, "undistorted", "stereo", "fusion.cfg")), there)
        model = [l for l in lines(output, "undistorted", "sparse", "images.txt") if not l.startswith("#")][0::2]
        self.assertEqual(sorted(line.split()[-1] for line in model), there)

    def test_interrupted_before_there_is_a_map(self):
        """It says so by its exit status, as any interrupted run does."""
        said = self.interrupt(self.list_of(self.names[:1] * 3000), self.path("still"))
        self.assertIn("no map could be made", said)
        self.assertLess(report(self.path("still"))["frames_total"], 3000)

    def test_standard_streams_that_are_closed(self):
        """What would be said goes into no file that is opened in their place."""
        program = os.path.join(os.environ["PROGRAMS"], "track_sequence")
        for closed in ("2>&-", "<&- >&- 2>&-"):
            output = self.path(closed.replace(" ", "_"))
            said = subprocess.run(["bash", "-c", 'exec "$0" "$@" ' + closed, program, "--images", self.list, "--camera",
                                   self.camera, "--output", output], stdout=subprocess.DEVNULL, timeout=300)
            self.assertEqual(said.returncode, 0)
            for name in ("trajectory.txt", "trajectory_live.txt", "points.ply", "colmap/images.txt"):
                self.assertEqual(content(output, name), content(self.tracked, name), (closed, name))

    def test_the_report_is_written_when_something_else_cannot_be(self):
        output = self.path("out")
        os.mkdir(output)
        with open(os.path.join(output, "colmap"), "w") as f:
            f.write("a file where a folder is to be")
        result = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--output", output, "--quiet")
        self.assertEqual((result.returncode, result.stderr.count("\n")), (2, 1), result.stderr)
        self.assertIn("colmap", result.stderr)
        self.assertIn("colmap", report(output)["problems"][0])
        self.assertEqual(report(output)["frames_posed"], FRAMES)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "untimely_ends", "__main__", sysargs=sys.argv)
