#!/usr/bin/python3
"""What the sanitizers of scripts/test --sanitize find must fail the program in which they find it."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import rosunit

INSTRUMENTATION = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "cmake" / "instrumentation.cmake"

PROJECT = f"""cmake_minimum_required(VERSION 3.13)
project(probe CXX)
include({INSTRUMENTATION})
add_executable(probe probe.cpp)
"""

# With an argument, a number that does not fit; the result is 0 all the same.
PROGRAM = """int main(int count, char**) {
  volatile double number = 1e20 * (count - 1);
  volatile int whole = static_cast<int>(number);
  return whole == 7;
}
"""


class SanitizerTest(unittest.TestCase):
    def test_undefined_behaviour_ends_the_program(self):
        """Beside AddressSanitizer, gcc's heeds no log_path: nobody counts what it says."""
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "CMakeLists.txt").write_text(PROJECT)
            pathlib.Path(folder, "probe.cpp").write_text(PROGRAM)
            for command in (["cmake", "-S", folder, "-B", folder + "/build", "-DCMAKE_BUILD_TYPE=Release",
                             "-DMONO_POSE_TRACKER_SANITIZE=address,undefined"],
                            ["cmake", "--build", folder + "/build"]):
                done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                self.assertEqual(done.returncode, 0, done.stdout)
            probe = folder + "/build/probe"
            self.assertEqual(subprocess.run([probe]).returncode, 0)
            done = subprocess.run([probe, "argument"], stderr=subprocess.PIPE, text=True)
            self.assertIn("runtime error", done.stderr)
            self.assertNotEqual(done.returncode, 0)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "sanitizer_test", SanitizerTest, sysargs=sys.argv)
