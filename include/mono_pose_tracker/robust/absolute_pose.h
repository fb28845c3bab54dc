#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

struct AbsolutePoseOptions {
  RansacOptions ransac;        // threshold: angle in radians between bearing and point
  std::vector<float> quality;  // empty, or one value a match, smaller is better (PROSAC order)
  // The pose is refined last with all matches that their noise explains, also beyond the threshold: as
  // precise as least squares of the correct matches. Left out where more matches lie beyond the threshold
  // than noise explains, as in a map that drifts. Score and inliers are of the pose before this step.
  bool refined_within_noise = true;
  // The result is refined once more from a threshold this many times as wide, at least 1 (left out), and the
  // pose with the lower cost is kept: with few inliers, a third of the results are local minima nearby.
  double widening = 3;
  int local_iterations = 5;   // of the refinement of a model just sampled, at least 0
  int final_iterations = 20;  // of the result, at least 1; quadratic convergence ends it after a few

  /// For a pose in a map that is being made: its points drift, and bundle adjustment refines the pose.
  static AbsolutePoseOptions in_growing_map(const RansacOptions& ransac) {
    AbsolutePoseOptions options;
    options.ransac = ransac;
    options.refined_within_noise = false;
    options.widening = 1;
    return options;
  }
};

/// Without success (fewer than three matches of use, or no pose with a fourth inlier) the pose is the
/// identity, the score 0, no match an inlier, and iterations tells what was tried.
struct AbsolutePoseReport {
  bool success = false;
  Rigid3 camera_from_map;  // in the unit of the points
  double score = 0;        // MSAC, rad^2
  int num_inliers = 0;
  std::vector<char> inliers;  // a flag for each match given, also without success
  int iterations = 0;
};

/// Pose of a camera from matches of unit bearings to map points: RANSAC with the P3P solver and local
/// optimisation. Throws std::invalid_argument on options out of range or sizes that differ.
AbsolutePoseReport estimate_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                          const std::vector<Eigen::Vector3d>& points_in_map,
                                          const AbsolutePoseOptions& options);

}  // namespace mono_pose_tracker
