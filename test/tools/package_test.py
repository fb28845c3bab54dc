#!/usr/bin/python3
"""The package as others see it: catkin_lint finds nothing, every program and script that a launch file or the README
names can be found by rosrun, and every ROS header that is installed is that of a package that is depended on."""
import glob
import os
import re
import shutil
import subprocess
import sys
import unittest
from xml.etree import ElementTree

import roslib.packages
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
NAME = "mono_pose_tracker"


def read(*path):
    with open(os.path.join(ROOT, *path)) as file:
        return file.read()


class PackageTest(unittest.TestCase):
    @unittest.skipUnless(shutil.which("catkin_lint"), "needs catkin_lint")
    def test_catkin_lint_finds_nothing(self):
        # A clone's folder may have any name.
        result = subprocess.run(["catkin_lint", "--strict", "-W2", "--ignore", "package_path_name", ROOT],
                                capture_output=True, text=True, timeout=120)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_installed_headers_are_of_exported_packages(self):
        own = {os.path.basename(p) for p in glob.glob(os.path.join(ROOT, "include", NAME, "*"))}
        exported = re.search(r"CATKIN_DEPENDS(.*?)DEPENDS", read("CMakeLists.txt"), re.S).group(1).split()
        depends = {d.text for d in ElementTree.fromstring(read("package.xml")).findall("depend")}
        of_package = {"ros": "roscpp", "rosbag": "rosbag_storage"}
        for header in glob.glob(os.path.join(ROOT, "include", "**", "*.h"), recursive=True):
            with open(header) as file:
                for folder in re.findall(r"^#include <(\w+)/\w+\.h>", file.read(), re.M):
                    if folder in own | {NAME, "opencv2", "boost"}:
                        continue
                    package = of_package.get(folder, folder)
                    self.assertIn(package, exported, header)
                    self.assertIn(package, depends, header)

    def test_rosrun_finds_what_is_named(self):
        documents = [read("README.md"), read("CONTRIBUTING.md")]
        documents += [read(path) for path in glob.glob(os.path.join(ROOT, "doc", "*.md"))]
        named = set(re.findall(r"rosrun mono_pose_tracker (\w+)", "".join(documents)))
        for file in glob.glob(os.path.join(ROOT, "launch", "*.launch")):
            for node in ElementTree.parse(file).getroot().iter("node"):
                if node.get("pkg") == NAME:
                    named.add(node.get("type"))
        self.assertLessEqual({"track_sequence", "plot_experiment", "play_bag", "camera_driver"}, named)
        if not os.path.exists("/usr/include/benchmark/benchmark.h"):
            named -= {"solver_benchmark", "feature_benchmark"}  # left out of the build without google-benchmark
        for program in named:
            self.assertTrue(roslib.packages.find_node(NAME, program), program)

    def test_python_scripts_that_are_named_are_installed(self):
        installed = re.search(r"install\(PROGRAMS (.*?) DESTINATION", read("CMakeLists.txt"), re.S).group(1).split()
        for script in ("camera_driver", "play_bag", "plot_costs", "plot_experiment"):
            self.assertIn("scripts/" + script, installed)


if __name__ == "__main__":
    rosunit.unitrun(NAME, "package", PackageTest, sysargs=sys.argv)
