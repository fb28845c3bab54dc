#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

struct AbsolutePoseOptions {
  RansacOptions ransac;        // threshold: angle in radians between bearing and point
  std::vector<float> quality;  // empty, or one value a match, smaller is better (PROSAC order)
};

struct AbsolutePoseReport {
  bool success = false;
  Rigid3 camera_from_map;
  double score = 0;  // MSAC, rad^2
  int num_inliers = 0;
  std::vector<char> inliers;
  int iterations = 0;
};

/// Pose of a camera from matches of unit bearings to map points: RANSAC with the P3P solver and local
/// optimisation. Throws std::invalid_argument on options out of range or sizes that differ.
AbsolutePoseReport estimate_absolute_pose(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                                          const std::vector<Eigen::Vector3d>& points_in_map,
                                          const AbsolutePoseOptions& options);

}  // namespace mono_pose_tracker
