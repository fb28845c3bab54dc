#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// How one pose is chosen among the solutions of a minimal solver.
enum class Choice {
  kCheirality,  // those poses that have the whole sample in front of both cameras, then the least Sampson
                // error
  kSampson,     // the least Sampson error, then of its four poses the one with most points in front
  kTruth,       // the one nearest to the truth: what the solver alone is capable of
};

/// Matched bearings, the sample first; the truth is looked at by Choice::kTruth only.
struct ChoiceInput {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  int sample_size;
  Rigid3 true_second_from_first;
};

/// Angles in degrees of the rotation and between the translations' directions that take one pose to another.
struct PoseError {
  double rotation_deg = 180, translation_deg = 180;
};
PoseError pose_error(const Rigid3& estimate, const Rigid3& truth);

/// The essential matrix nearest to a fundamental matrix of bearings: singular values 1, 1, 0.
Eigen::Matrix3d nearest_essential(const Eigen::Matrix3d& matrix);

/// The pose chosen among the essential matrices; false when none is left.
bool choose_pose(const std::vector<Eigen::Matrix3d>& essentials, const ChoiceInput& input, Choice choice,
                 Rigid3* second_from_first);

}  // namespace mono_pose_tracker
