#pragma once

#include <Eigen/Core>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

/// A plane seen in the first view: n . X = 1 for its points X in units of the baseline; at infinity where
/// none was found.
struct PlaneFit {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  int num_inliers = 0;
};

/// The plane that most of the given pairs lie on: those that its homography R + t n^T maps within threshold
/// (radians).
PlaneFit fit_plane(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                   std::uint64_t seed);

/// The other motion with the same homography R + t n^T (the two-fold ambiguity of a plane: Longuet-Higgins
/// 1986). False where the two are one.
bool second_planar_solution(const TwoViewModel& model, const Eigen::Vector3d& normal, TwoViewModel* second);

/// A motion that a narrow view can hardly tell from the given one: the turn about the axis across the view
/// scaled by a factor, the point at the middle of the pairs staying where both views see it. Factor -1 is
/// Necker's reversal of depth, others the bas-relief ambiguity (Koenderink and van Doorn 1991).
bool turn_scaled(const BearingPairs& pairs, const TwoViewModel& model, double factor, TwoViewModel* scaled);

/// The rotation that maps most of the given pairs within threshold (radians): RANSAC on two pairs, refined.
struct RotationFit {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // second_from_first
  int num_inliers = 0;
};
RotationFit fit_rotation(const BearingPairs& pairs, double threshold, std::uint64_t seed);

}  // namespace mono_pose_tracker
