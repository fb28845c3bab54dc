#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// A pose block: a turn w of the camera in its place, and how far it moves, both from where it began and along
// its own axes. It is its own tangent, so that all blocks have six parameters, of which Ceres has compiled
// code, and no derivative is multiplied by another. A turn about the map's origin instead would move a camera
// far from it by much more than it turns, and damping would keep it from turning at all.
using PoseBlock = std::array<double, 6>;

// What all observations of a camera share at the parameters under evaluation.
struct CameraState {
  Eigen::Matrix3d start_rotation;  // camera_from_map, as it began
  Eigen::Vector3d start_translation;
  Eigen::Matrix3d rotation;  // camera_from_map; exp(w) start_rotation
  Eigen::Vector3d translation;
  Eigen::Vector3d moved;          // v, of translation = exp(w) start_translation + v
  Eigen::Matrix3d left_jacobian;  // of exp at w
  // Of the block's parameters one that must stay, or -1: its derivatives are left out, and Ceres finds no
  // reason to move it, while all blocks keep the same size.
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

// The cameras of a problem as parameters, and what holds its gauge.
struct BundleCameras {
  // All observations of the problem are heeded.
  explicit BundleCameras(const BundleProblem& problem);

  std::vector<PoseBlock> blocks;
  std::vector<CameraState> states;  // at the blocks' start
  std::vector<char> used;           // they see anything
  std::vector<int> free;            // of these, those that may move

  // Where the blocks are now.
  Rigid3 pose(std::size_t camera) const;
};

}  // namespace mono_pose_tracker
