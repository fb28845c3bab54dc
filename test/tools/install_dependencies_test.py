#!/usr/bin/python3
"""scripts/install_dependencies beside a ROS in /opt/ros. The programs that it calls are replaced: nothing is installed."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from xml.etree import ElementTree

import rosunit

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
SCRIPT = os.path.join(ROOT, "scripts", "install_dependencies")


class InstallDependenciesTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.opt_ros = self.made("opt_ros")
        self.programs = self.made("programs")
        self.log = os.path.join(self.folder.name, "log")
        # Installed: cmake. Unknown to apt: ros-one-rviz, libopengv-dev.
        self.program("dpkg-query", 'for p in "$@"; do [ "$p" != cmake ] || echo "cmake installed"; done')
        self.program("apt-cache", 'case $2 in ros-one-rviz | libopengv-dev) exit 100 ;; esac')
        self.program("apt-get", f'echo "$@" >> {self.log}')
        self.program("id", "echo 0")

    def made(self, *parts):
        path = os.path.join(self.folder.name, *parts)
        os.makedirs(path, exist_ok=True)
        return path

    def program(self, name, script):
        path = os.path.join(self.programs, name)
        with open(path, "w") as file:
            file.write("#!/bin/bash\n" + script + "\n")
        os.chmod(path, 0o755)

    def ros(self, distro, *packages):
        open(os.path.join(self.made("opt_ros", distro), "setup.bash"), "w").close()
        for package in packages:
            open(os.path.join(self.made("opt_ros", distro, "share", package), "package.xml"), "w").close()

    def run_script(self, *arguments, **environment):
        path = {"PATH": self.programs + ":/usr/bin:/bin", "MONO_POSE_TRACKER_OPT_ROS": self.opt_ros, **environment}
        done = subprocess.run([SCRIPT, *arguments], capture_output=True, text=True, timeout=60, env=path)
        installed = []
        if os.path.exists(self.log):
            with open(self.log) as file:
                for line in file:
                    if line.startswith("install"):
                        installed += [word for word in line.split()[1:] if not word.startswith("-")]
        return done, installed

    def test_the_rest_is_installed_with_a_ros_in_opt(self):
        self.ros("one", "catkin", "roscpp", "nodelet")
        done, installed = self.run_script("--peers")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLessEqual({"libceres-dev", "ros-one-cv-bridge", "ros-one-rosbag-storage"}, set(installed))
        for name in ("cmake", "ros-one-roscpp", "ros-one-nodelet", "ros-one-rviz", "catkin", "ros-core-dev", "rviz", "libcv-bridge-dev"):
            self.assertNotIn(name, installed)
        self.assertIn(f"using the ROS in {self.opt_ros}/one, with which this package was not tried", done.stderr)
        self.assertIn("apt does not have: libopengv-dev ros-one-rviz.", done.stderr)
        done, _ = self.run_script("--ros-setup")
        self.assertEqual(done.stdout, self.opt_ros + "/one/setup.bash\n")

    def test_ros_distro_selects(self):
        self.ros("noetic", "catkin")
        self.ros("one", "catkin")
        for distro, chosen in (("one", "one"), ("noetic", "noetic"), ("", "noetic"), ("humble", "noetic")):
            done, _ = self.run_script("--ros-setup", ROS_DISTRO=distro)
            self.assertEqual(done.stdout, f"{self.opt_ros}/{chosen}/setup.bash\n", distro)

    def test_ros_2_is_refused(self):
        self.ros("humble", "ament_cmake")
        done, installed = self.run_script()
        self.assertEqual((done.returncode, installed), (1, []))
        self.assertRegex(done.stderr, "is not ROS 1, .*Missing: .*libceres-dev")
        self.assertEqual(self.run_script("--ros-setup")[0].stdout, "")

    def test_without_it_debians_ros_is_installed(self):
        done, installed = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLessEqual({"ros-core-dev", "libcv-bridge-dev", "libceres-dev"}, set(installed))
        self.assertEqual(self.run_script("--ros-setup")[0].stdout, "")

    def test_the_list_is_that_of_the_package(self):
        with open(SCRIPT) as file:
            listed = set(re.search(r"of_opt_ros=\((.*?)\)", file.read(), re.S).group(1).split())
        tags = ("buildtool_depend", "build_depend", "depend", "exec_depend", "test_depend")
        root = ElementTree.parse(os.path.join(ROOT, "package.xml")).getroot()
        named = {element.text for tag in tags for element in root.iter(tag)}
        of_the_system = {"cli11", "eigen", "libopencv-dev", "boost", "libceres-dev", "libjpeg", "yaml-cpp", "nlohmann-json-dev",
                         "libsqlite3-dev", "liblz4-dev", "libzstd-dev", "pybind11-dev", "python3-rospkg", "python3-rosbag",
                         "python3-matplotlib"}
        self.assertEqual(sorted(named - of_the_system - listed), [])


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "install_dependencies", InstallDependenciesTest, sysargs=sys.argv)
