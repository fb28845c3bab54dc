#!/usr/bin/python3
"""scripts/demo checks what it is given before it builds anything."""
import os
import subprocess
import sys
import tempfile
import unittest

import rosunit

DEMO = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts", "demo")


class DemoTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def run_demo(self, *arguments):
        environment = {**os.environ, "MONO_POSE_TRACKER_BUILD": self.folder + "/build", "HOME": self.folder}
        return subprocess.run([DEMO, *arguments], capture_output=True, text=True, timeout=60, env=environment)

    def test_mistakes_are_named_before_the_build(self):
        there = self.folder + "/there.mp4"
        open(there, "w").close()
        for arguments, words in ((["--rate", "fast"], "--rate fast"), (["--rate", "0"], "--rate 0"),
                                 (["--rate"], "--rate needs a value"), (["--fast"], "--fast"),
                                 (["/no/such.bag"], "/no/such.bag"), ([there], "--hfov"),
                                 ([there, "--camera", "/no/camera.yaml"], "/no/camera.yaml"),
                                 ([there, "--hfov", "wide"], "--hfov wide"),
                                 ([there, "--hfov", "60", "--camera", there], "not both"),
                                 ([there, "--hfov", "60", "--reference", "/no/truth.txt"], "/no/truth.txt"),
                                 ([there, there], "not two"), (["--output", there], there)):
            result = self.run_demo(*arguments)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertEqual(os.listdir(self.folder), ["there.mp4"], "nothing is built or written")

    def test_the_build_of_another_clone_is_named(self):
        os.mkdir(self.folder + "/build")
        with open(self.folder + "/build/CMakeCache.txt", "w") as cache:
            cache.write("CMAKE_HOME_DIRECTORY:INTERNAL=/clones/first\n")
        result = self.run_demo()
        self.assertEqual(result.returncode, 2, result.stderr)
        for words in ("/clones/first", self.folder + "/build", "MONO_POSE_TRACKER_BUILD"):
            self.assertIn(words, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)

    def test_help(self):
        result = self.run_demo("--help")
        self.assertEqual(result.returncode, 0)
        self.assertIn("--hfov DEGREES", result.stdout)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "demo", DemoTest, sysargs=sys.argv)
