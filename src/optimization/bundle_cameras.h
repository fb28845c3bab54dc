#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Pose block: a rotation w of the camera about its centre and its translation, relative to the initial pose
// and along the initial axes. The parameters are their own tangent space: all blocks have six parameters, for
// which Ceres has compiled code, and no derivative is multiplied by another. With a rotation about the map's
// origin, a distant camera would be translated much more than rotated, and damping would suppress its
// rotation.
using PoseBlock = std::array<double, 6>;

// Quantities shared by all observations of a camera at the evaluated parameters.
struct CameraState {
  Eigen::Matrix3d start_rotation;  // camera_from_map, as it began
  Eigen::Vector3d start_translation;
  Eigen::Matrix3d rotation;  // camera_from_map; exp(w) start_rotation
  Eigen::Vector3d translation;
  Eigen::Vector3d moved;          // v, of translation = exp(w) start_translation + v
  Eigen::Matrix3d left_jacobian;  // of exp at w
  // Index of the constant parameter of the block, or -1. Its derivatives are set to zero, so that Ceres does
  // not move it, and all blocks keep the same size.
  int held = -1;

  void update(const double* block) {
    const Eigen::Vector3d w(block[0], block[1], block[2]);
    moved << block[3], block[4], block[5];
    const double a2 = w.squaredNorm(), a = std::sqrt(a2);
    // sin(a) / a, (1 - cos(a)) / a^2, (a - sin(a)) / a^3; below 1e-3 their series end beyond rounding.
    double s = 1 - a2 / 6, c = 0.5 - a2 / 24, d = 1.0 / 6 - a2 / 120;
    if (a > 1e-3) s = std::sin(a) / a, c = (1 - std::cos(a)) / a2, d = (1 - s) / a2;
    const Eigen::Matrix3d cross = cross_matrix(w), cross2 = cross * cross;
    const Eigen::Matrix3d turn = Eigen::Matrix3d::Identity() + s * cross + c * cross2;
    rotation = turn * start_rotation;
    translation = turn * start_translation + moved;
    left_jacobian = Eigen::Matrix3d::Identity() + c * cross + d * cross2;
  }
};

// The cameras of a problem as parameter blocks, and the fixed gauge.
struct BundleCameras {
  // All observations of the problem are used.
  explicit BundleCameras(const BundleProblem& problem);

  std::vector<PoseBlock> blocks;
  std::vector<CameraState> states;  // at the blocks' start
  std::vector<char> used;           // they see anything
  std::vector<int> free;            // of these, those that may move

  // Pose of a camera for the present blocks.
  Rigid3 pose(std::size_t camera) const;
};

}  // namespace mono_pose_tracker
