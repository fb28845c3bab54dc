#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// A point of a map and one camera's observation of it, all in the map's frame.
struct ObservedPoint {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();        // in the map
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   // of the camera
  Eigen::Vector3d bearing = Eigen::Vector3d::Zero();  // of the observation; any norm
  /// Relative standard deviation of its distance from the camera; infinite: unknown.
  double depth_sigma = std::numeric_limits<double>::infinity();
};

/// The same point in two maps.
struct SimilarityMatch {
  ObservedPoint in_a, in_b;

  /// Relative standard deviation of the ratio of its two distances.
  double depth_sigma() const { return std::hypot(in_a.depth_sigma, in_b.depth_sigma); }
};

struct SimilarityOptions {
  // threshold: angle in radians between a viewing ray and the other map's point
  RansacOptions ransac;
  double threshold_sigmas = 3;  // standard deviations of this angle in the threshold
  /// Largest standard deviation of the rotation about the worst axis (deg). It is large when all inliers lie
  /// near one line. A less certain rotation would distort a map more than drift does.
  double max_rotation_sigma_deg = 2;
  /// Largest relative standard deviation of the scale. A wrong scale distorts a map where its parts are
  /// joined, and the following bundle adjustment must be able to correct that.
  double max_scale_sigma = 0.1;

  int max_iterations = 20;      // of the last refinement; quadratic convergence ends it after a few
  std::size_t max_cameras = 6;  // of each map, those with most rays: a few determine the similarity
  std::size_t max_scales = 25;  // tried for each camera, from rays of the others
};

struct SimilarityReport {
  bool success = false;
  Sim3 b_from_a;
  double score = 0;  // MSAC, rad^2
  int num_inliers = 0;
  std::vector<char> inliers;      // a flag for each ray or match
  double rotation_sigma_deg = 0;  // standard deviation about the worst axis
  double scale_sigma = 0;         // relative
};

/// A camera of one map observes a point of the other.
struct RayToPoint {
  bool is_of_a = true;  // the camera is of map a, the point of b; else vice versa
  int camera = -1;      // in its map
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   // of the camera, in its map
  Eigen::Vector3d bearing = Eigen::Vector3d::Zero();  // of the observation, in its map; unit length
  Eigen::Vector3d x = Eigen::Vector3d::Zero();        // of the point, in the other map
};

/// Similarity between two maps whose cameras observe points of the other map, where few points are in both
/// (pose and scale of a rig, as Ventura et al. 2014, A minimal solution to the generalized pose-and-scale
/// problem; here by the absolute poses of the cameras with most rays and the scale of one more ray, then
/// least squares). Residuals are the angles between the rays and the points. No success with three rays or
/// fewer, when the rays do not determine the rotation or the scale (max_rotation_sigma_deg, max_scale_sigma),
/// or with less than half of the inliers that the cameras have when each has its own pose: then they do not
/// agree on a similarity. Throws std::invalid_argument on options out of range.
SimilarityReport estimate_similarity_from_rays(const std::vector<RayToPoint>& rays,
                                               const SimilarityOptions& options);

/// Least squares from an initial similarity, weighted by covariance, including the depth uncertainty of both
/// maps along their own viewing rays (Mahalanobis distance; total least squares). It determines the
/// orientation of a patch of a wall that one map observes from its left and the other from its right. Each
/// depth_sigma must be finite; matches of one point must be adjacent, as they share its errors. Inliers lie
/// within the threshold's standard deviations in both directions; up to 6 % of the correct matches do not. No
/// success with seven points or fewer, or where they do not determine the rotation or the scale.
SimilarityReport refine_similarity_by_depths(const std::vector<SimilarityMatch>& matches,
                                             const SimilarityOptions& options, const Sim3& start);

}  // namespace mono_pose_tracker
