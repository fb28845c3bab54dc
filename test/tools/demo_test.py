#!/usr/bin/python3
"""scripts/demo checks what it is given before it builds anything; clones do not build over each other."""
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
                                 ([there, "--hfov", "wide"], "--hfov wide"), ([there, "--hfov", "200"], "--hfov 200"),
                                 ([there, "--hfov", "60", "--camera", there], "not both"),
                                 ([there, "--hfov", "60", "--reference", "/no/truth.txt"], "/no/truth.txt"),
                                 ([there, there], "not two"), (["--output", there], there)):
            result = self.run_demo(*arguments)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertEqual(os.listdir(self.folder), ["there.mp4"], "nothing is built or written")

    def build_folder(self):
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("MONO_POSE_TRACKER_BUILD", "XDG_CACHE_HOME")}
        result = subprocess.run([os.path.join(os.path.dirname(DEMO), "build_folder")], capture_output=True, text=True,
                                env={**environment, "HOME": self.folder}, check=True)
        return result.stdout.strip()

    def test_each_clone_has_a_build_folder_of_its_own(self):
        first = self.folder + "/.cache/mono_pose_tracker/build"
        self.assertEqual(self.build_folder(), first)
        os.makedirs(first)
        for built_from, is_ours in ((os.path.dirname(os.path.dirname(DEMO)), True), ("/clones/first", False)):
            with open(first + "/CMakeCache.txt", "w") as cache:
                cache.write("CMAKE_HOME_DIRECTORY:INTERNAL=%s\n" % built_from)
            folder = self.build_folder()
            self.assertEqual(folder == first, is_ours, folder)
            self.assertTrue(folder.startswith(first), folder)

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
