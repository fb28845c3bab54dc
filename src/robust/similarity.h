#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// A point of a map and one camera's sight of it, all in the map's frame.
struct ObservedPoint {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();        // where the map has it
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   // of the camera
  Eigen::Vector3d bearing = Eigen::Vector3d::Zero();  // from there, where the image has it; of any length
  /// Standard deviation of its distance from there, relative; infinite where that is not to count.
  double depth_sigma = std::numeric_limits<double>::infinity();
};

/// The same point as two maps have it.
struct SimilarityMatch {
  ObservedPoint in_a, in_b;

  /// Of the ratio of its two distances, relative.
  double depth_sigma() const { return std::hypot(in_a.depth_sigma, in_b.depth_sigma); }
};

struct SimilarityOptions {
  static constexpr double kThresholdSigmas = 3;
  // threshold: angle in radians between a sight and the other map's point, on both sides; kThresholdSigmas
  // standard deviations of it
  RansacOptions ransac;
  /// Standard deviation about the worst axis, which is large when all inliers lie near one line. A rotation
  /// less certain than this would bend a map more than drift does.
  double max_rotation_sigma_deg = 2;
  /// Relative, standard deviation. What a scale is off by bends the map where its parts are fitted together,
  /// and a bundle adjustment that follows must still be able to mend that.
  double max_scale_sigma = 0.1;
};

struct SimilarityReport {
  bool success = false;
  Sim3 b_from_a;
  double score = 0;  // MSAC, rad^2
  int num_inliers = 0;
  std::vector<char> inliers;      // a flag a match
  double rotation_sigma_deg = 0;  // standard deviation about the worst axis
  double scale_sigma = 0;         // relative
  int iterations = 0;
};

/// Similarity between two maps from points that both have: RANSAC over triangles of points (Umeyama 1991),
/// then least squares. Errors are the angles between where a camera of one map sees a point and where the
/// other map has it, both ways; so depth, which a map knows least, counts no more than it should. Where both
/// maps say how well they know it, it counts by that: of a patch of a wall that both see from one side only,
/// the angles leave two similarities, which differ by the way it faces. No success
/// with three inliers or fewer, or when they do not determine the rotation or the scale (see
/// max_rotation_sigma_deg, max_scale_sigma).
/// Throws std::invalid_argument on options out of range.
SimilarityReport estimate_similarity(const std::vector<SimilarityMatch>& matches,
                                     const SimilarityOptions& options);

/// The same from a similarity that is nearly known already: least squares alone.
SimilarityReport refine_similarity(const std::vector<SimilarityMatch>& matches,
                                   const SimilarityOptions& options, const Sim3& start);

/// Least squares where errors count by their covariance, of which what neither map knows of depth is a part:
/// off along its own sight, a point is off across the other's (Mahalanobis distance; total least squares).
/// What tells which way a patch of a wall faces that one map has from its left, the other from its right.
/// Each depth_sigma is finite; matches of one point lie side by side: they share its errors. Inliers lie
/// within the threshold's standard deviations both ways: of what is right up to 6 % do not. No success with
/// seven points or fewer, or where they leave the rotation or the scale open.
SimilarityReport refine_similarity_by_depths(const std::vector<SimilarityMatch>& matches,
                                             const SimilarityOptions& options, const Sim3& start);

}  // namespace mono_pose_tracker
