#!/usr/bin/python3
"""A long simulated run, live, along a way that never comes back, in a map that is capped: MONO_POSE_TRACKER_SOAK_MINUTES of it (default: two, coarse ones)."""
import os
import re
import statistics
import subprocess
import sys
import tempfile
import unittest

import rosunit

PROGRAM = os.path.join(os.environ["PROGRAMS"], "pipeline_benchmark")
MINUTES = float(os.environ.get("MONO_POSE_TRACKER_SOAK_MINUTES", "2"))
SHORT = MINUTES < 10
# MB an hour after the first quarter; the short form cannot tell that little from what the allocator keeps back.
MOST_GROWTH_AN_HOUR, NOISE_MB = 2.0, 8.0 if SHORT else 0.0


def usage(pid):
    """Resident MB, threads, open files."""
    with open("/proc/%d/status" % pid) as status:
        resident = next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS:"))
    return resident, len(os.listdir("/proc/%d/task" % pid)), len(os.listdir("/proc/%d/fd" % pid))


class SoakTest(unittest.TestCase):
    def test_a_simulated_run(self):
        # Few images a second make the short form's minutes short. At a camera's 30 the poses of the newest 20,000
        # frames, which are kept, are all there before the first quarter of an hour is over.
        rate, size = (5, ("160", "120")) if SHORT else (30, ("320", "240"))
        lines = MINUTES if not SHORT else 4 * MINUTES  # a line is told for each simulated minute
        with tempfile.TemporaryDirectory() as folder:
            config = os.path.join(folder, "capped.yaml")
            with open(config, "w") as file:
                file.write("mapping:\n  max_keyframes: 40\n")
            program = subprocess.Popen([PROGRAM, "--simulate", "corridor", "--minutes", str(lines), "--rate", str(rate),
                                        "--width", size[0], "--height", size[1], "--unpaced", "--config", config],
                                       stdout=subprocess.PIPE, text=True)
            self.addCleanup(program.wait)
            self.addCleanup(program.kill)
            samples, registered = [], 0
            for line in program.stdout:
                if re.match(r"\s+\d+\s", line):
                    registered += int(line.split()[1])
                    if len(samples) + 1 < lines:  # after the last line it ends
                        samples.append(usage(program.pid))
            self.assertEqual(program.wait(), 0)
        self.assertGreater(registered, 0.5 * 60 * rate * lines, "it tracked")
        later = samples[len(samples) // 4:]
        self.assertGreaterEqual(len(later), 3)
        self.assertLessEqual(later[-1][1], later[0][1], "threads")
        self.assertLessEqual(later[-1][2], later[0][2], "open files")
        if "ASAN_OPTIONS" in os.environ:
            return  # AddressSanitizer keeps what is freed, up to 256 MB of it
        # The allocator gives back a megabyte and takes it again from one minute to the next: medians of a third each.
        third = len(later) // 3
        growth = statistics.median(s[0] for s in later[-third:]) - statistics.median(s[0] for s in later[:third])
        self.assertLess(growth, NOISE_MB + MOST_GROWTH_AN_HOUR * (len(later) - third) / 60,
                        "MB, of %s" % [round(s[0], 1) for s in later])


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "soak", SoakTest, sysargs=sys.argv)
