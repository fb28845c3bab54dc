#!/usr/bin/python3
"""What `cmake --install` puts into a prefix, used from there without ROS: the README's C++ program and pymonopose. PROGRAMS names the
folder of the programs, in the build folder."""
import glob
import os
import re
import subprocess
import sys
import unittest

import cv2
import numpy
import rosunit

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
sys.path.insert(0, os.path.join(ROOT, "test", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import SLOWNESS, RunsOfARoom, rows  # noqa: E402

BUILD = os.path.realpath(os.path.join(os.environ["PROGRAMS"], "..", "..", ".."))
HAS_MODULE = glob.glob(os.path.join(BUILD, "devel", "lib", "python3", "dist-packages", "pymonopose*.so"))
# Neither the paths of a ROS nor those of the build.
PLAIN = {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/"), "LANG": "C.UTF-8"}
ROS = r"librosc|libroslib|librosbag|librosconsole|libcv_bridge|libnodelet|libtf2|/include/(?:ros|sensor_msgs|std_msgs)/"


def run(*arguments, **environment):
    return subprocess.run(arguments, capture_output=True, text=True, timeout=300 * SLOWNESS, env={**PLAIN, **environment})


def code_after(words, text):
    """The first indented block after these words."""
    block = re.search(r"(?:^(?: {4}.*)?\n)+", text[text.index(words):].partition("\n\n")[2], re.M).group(0)
    return re.sub(r"^ {4}", "", block, flags=re.M)


class InstalledTest(RunsOfARoom):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = os.path.join(cls.made.name, "prefix")
        done = run("cmake", "--install", BUILD, "--prefix", cls.prefix)
        assert done.returncode == 0, done.stdout + done.stderr

    def expect_no_ros(self, path):
        libraries = run("ldd", path)
        self.assertEqual(libraries.returncode, 0, libraries.stderr)
        self.assertNotIn("not found", libraries.stdout)
        self.assertNotRegex(libraries.stdout, ROS)
        return libraries.stdout

    def test_the_program_of_the_readme(self):
        with open(os.path.join(ROOT, "README.md")) as file:
            readme = file.read()
        source, build = self.path("follow"), self.path("built")
        os.makedirs(source)
        with open(os.path.join(source, "follow.cpp"), "w") as file:
            file.write(code_after("and `follow.cpp` prints", readme))
        with open(os.path.join(source, "CMakeLists.txt"), "w") as file:
            file.write("cmake_minimum_required(VERSION 3.13)\nproject(follow CXX)\n")
            file.write(code_after("A program's `CMakeLists.txt` has", readme))
        for arguments in (["-S", source, "-B", build, "-DCMAKE_PREFIX_PATH=" + self.prefix, "-DCMAKE_BUILD_TYPE=Release",
                           "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_roscpp=ON"],
                          ["--build", build]):
            done = run("cmake", *arguments)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(os.path.join(build, "CMakeCache.txt")) as file:
            self.assertIn(f"mono_pose_tracker_DIR:PATH={self.prefix}/lib/cmake/mono_pose_tracker\n", file.read())
        with open(os.path.join(build, "CMakeFiles", "follow.dir", "follow.cpp.o.d")) as file:
            headers = file.read()
        self.assertIn(self.prefix + "/include/mono_pose_tracker/tracking/tracker.h", headers)
        self.assertNotRegex(headers, ROS)
        self.assertNotIn(ROOT, headers)
        program = os.path.join(build, "follow")
        self.assertIn(self.prefix + "/lib/libmono_pose_tracker.so", self.expect_no_ros(program))

        pattern = self.path("%03d.png")  # a video for VideoCapture
        for i, name in enumerate(self.names):
            cv2.imwrite(pattern % i, cv2.imread(os.path.join(self.images, name)))
        followed = run(program, self.camera, pattern)
        self.assertEqual(followed.returncode, 0, followed.stderr)
        lines = numpy.array([[float(word) for word in line.split()] for line in followed.stdout.splitlines()])
        self.assertGreater(len(lines), 0.8 * len(self.names))
        truth = numpy.array([[float(word) for word in row[1:4]] for row in rows(self.truth)])[lines[:, 0].astype(int)]
        # The distances between positions are those of the truth, but for one scale.
        found, true = (numpy.linalg.norm(x - x[0], axis=1)[1:] for x in (lines[:, 1:], truth))
        scale = (found @ true) / (found @ found)
        self.assertLess(numpy.abs(scale * found - true).max(), 0.02 * true.max())

    def test_a_catkin_package_gets_catkins_variables(self):
        source = self.path("catkin_package")
        os.makedirs(source)
        with open(os.path.join(source, "CMakeLists.txt"), "w") as file:
            file.write("cmake_minimum_required(VERSION 3.13)\nproject(other CXX)\nset(PYTHON_EXECUTABLE /usr/bin/python3)\n"
                       "find_package(catkin REQUIRED COMPONENTS roscpp)\nfind_package(mono_pose_tracker REQUIRED)\n"
                       'message(STATUS "has ${mono_pose_tracker_LIBRARIES}")\n')
        done = run("cmake", "-S", source, "-B", self.path("other"),
                   "-DCMAKE_PREFIX_PATH=" + self.prefix + ";" + os.environ.get("CMAKE_PREFIX_PATH", "").replace(":", ";"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"has {self.prefix}/lib/libmono_pose_tracker.so;{self.prefix}/lib/libmono_pose_tracker_nodelets.so;", done.stdout)

    def test_the_programs_find_their_library(self):
        program = os.path.join(self.prefix, "lib", "mono_pose_tracker", "evaluate_trajectory")
        self.expect_no_ros(program)
        done = run(program, "--reference", self.truth, "--estimate", os.path.join(self.tracked, "trajectory.txt"))
        self.assertEqual(done.returncode, 0, done.stderr)

    @unittest.skipUnless(HAS_MODULE, "needs pymonopose (pybind11-dev)")
    def test_the_python_module(self):
        folder = os.path.join(self.prefix, "lib", "python3", "dist-packages")
        code = f"""
import numpy, pymonopose
print(pymonopose.__file__)
points = numpy.random.default_rng(1).uniform(-1, 1, (5, 3)) + [0, 0, 5]
moved = points + [0.5, 0.1, 0]
x1, x2 = (numpy.c_[p[:, :2] / p[:, 2:], numpy.ones(5)] for p in (points, moved))
found = pymonopose.five_point(x1, x2)
print(min(numpy.abs(numpy.einsum("ni,ij,nj->n", x2, e, x1)).max() for e in found))
result = pymonopose.reconstruct({self.images!r}, pymonopose.Camera.from_yaml({self.camera!r}))
print(result.verdict, len(result.poses))
numpy.savetxt({self.path("positions.txt")!r}, result.poses[:, :3, 3], fmt="%.17g")
"""
        done = run("/usr/bin/python3", "-c", code, PYTHONPATH=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        file, residual, verdict = done.stdout.splitlines()
        self.assertEqual(os.path.dirname(file), folder)
        self.assertLess(float(residual), 1e-10)
        self.assertEqual(verdict, f"confirmed {len(self.names)}")
        tracked = numpy.array([[float(word) for word in row[1:4]] for row in rows(self.tracked, "trajectory.txt")])
        numpy.testing.assert_allclose(numpy.loadtxt(self.path("positions.txt")), tracked, atol=1e-9)
        self.assertIn(self.prefix + "/lib/libmono_pose_tracker.so", os.path.normpath(re.search(r"(\S+/libmono_pose_tracker\.so) \(", self.expect_no_ros(file)).group(1)))
        self.assertTrue(os.path.isfile(os.path.join(folder, "pymonopose.pyi")))

    def test_every_public_header_is_installed(self):
        def headers(folder):
            return sorted(os.path.relpath(os.path.join(path, name), folder)
                          for path, _, names in os.walk(folder) for name in names if not name.endswith("TrackerStatus.h"))
        self.assertEqual(headers(os.path.join(self.prefix, "include", "mono_pose_tracker")),
                         headers(os.path.join(ROOT, "include", "mono_pose_tracker")))

    def test_configured_without_ros(self):
        """Neither catkin nor a message package is looked for."""
        build = self.path("without_ros")
        done = run("cmake", "-S", ROOT, "-B", build, "-DMONO_POSE_TRACKER_ROS=OFF", "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON",
                   "-DPYTHON_EXECUTABLE=/usr/bin/python3", "-DCATKIN_ENABLE_TESTING=ON")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        targets = run("cmake", "--build", build, "--target", "help").stdout
        for target in ("mono_pose_tracker", "evaluate_trajectory"):
            self.assertRegex(targets, rf"(?m)^\.\.\. {target}$")
        self.assertNotRegex(targets, r"(?m)^\.\.\. (?:mono_pose_tracker_nodelets|track_sequence|tracker_node)$")
        with open(os.path.join(build, "CMakeCache.txt")) as file:
            self.assertNotRegex(file.read(), r"(?m)^(?:catkin|roscpp|sensor_msgs)_DIR")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "installed", InstalledTest, sysargs=sys.argv)
