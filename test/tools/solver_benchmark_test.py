#!/usr/bin/python3
"""solver_benchmark with PoseLib, which Debian does not have: its part is compiled here against PoseLib 3.0's public
signatures, so that it stays buildable (-DPoseLib_DIR=)."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import rosunit

ROOT = pathlib.Path(__file__).resolve().parents[2]

HEADERS = {
    "camera_pose.h": """
#include <Eigen/Dense>
#include <vector>
namespace poselib {
struct CameraPose {
  Eigen::Vector4d q;  // w, x, y, z
  Eigen::Vector3d t;
  Eigen::Matrix3d R() const;
};
using CameraPoseVector = std::vector<CameraPose>;
}
""",
    "solvers/p3p.h": """
#include "PoseLib/camera_pose.h"
namespace poselib {
int p3p(const std::vector<Eigen::Vector3d>& x, const std::vector<Eigen::Vector3d>& X, CameraPoseVector* output);
}
""",
    "solvers/relpose_5pt.h": """
#include "PoseLib/camera_pose.h"
namespace poselib {
int relpose_5pt(const std::vector<Eigen::Vector3d>& x1, const std::vector<Eigen::Vector3d>& x2,
                CameraPoseVector* output);
}
""",
    "robust.h": """
#include <string>
#include "PoseLib/camera_pose.h"
namespace poselib {
using Point2D = Eigen::Vector2d;
using Point3D = Eigen::Vector3d;
struct Camera {
  Camera();
  Camera(const std::string& model_name, const std::vector<double>& params, int width, int height);
};
struct Image {
  CameraPose pose;
  Camera camera;
};
struct RansacOptions {
  size_t max_iterations, min_iterations;
  double success_prob;
};
struct RansacStats {
  size_t num_inliers;
};
struct AbsolutePoseOptions {
  RansacOptions ransac;
  double max_error;
};
struct RelativePoseOptions {
  RansacOptions ransac;
  double max_error;
};
RansacStats estimate_absolute_pose(const std::vector<Point2D>& points2D, const std::vector<Point3D>& points3D,
                                   const AbsolutePoseOptions& options, Image* image, std::vector<char>* inliers);
RansacStats estimate_relative_pose(const std::vector<Point2D>& x1, const std::vector<Point2D>& x2,
                                   const Camera& camera1, const Camera& camera2,
                                   const RelativePoseOptions& options, CameraPose* pose, std::vector<char>* inliers);
}
""",
}

PROGRAM = """#include "tools/study/minimal_solvers.h"
#include "tools/study/robust_estimators.h"

int main() {
  using namespace mono_pose_tracker;
  const auto has_poselib = [](const auto& methods) {
    for (const auto& method : methods) {
      if (method.name == "poselib") return true;
    }
    return false;
  };
  return has_poselib(five_point_solvers()) && has_poselib(p3p_solvers()) && has_poselib(relative_pose_estimators()) &&
         has_poselib(absolute_pose_estimators());
}
"""


def compiled(definitions=()):
    """Compiles the solvers and estimators of the study; returns what the compiler said, or None."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in HEADERS.items():
            path = pathlib.Path(folder, "PoseLib", name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("#pragma once\n" + text)
        program = pathlib.Path(folder, "program.cpp")
        program.write_text(PROGRAM)
        done = subprocess.run(["c++", "-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-I", folder, "-I",
                               ROOT / "src", "-I", ROOT / "include", "-isystem", "/usr/include/opencv4",
                               "-isystem", "/usr/include/eigen3", *definitions, program],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return None if done.returncode == 0 else done.stdout


class SolverBenchmark(unittest.TestCase):
    def test_it_compiles_with_poselib(self):
        self.assertIsNone(compiled(["-DMONO_POSE_TRACKER_WITH_POSELIB"]))

    def test_and_without_it(self):
        self.assertIsNone(compiled())


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "solver_benchmark_test", SolverBenchmark, sysargs=sys.argv)
