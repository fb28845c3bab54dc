#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/geometry/motion.h"
#include "robust/packets.h"
#include "robust/ransac.h"

namespace mono_pose_tracker {

/// Unit bearings matched to map points, in a seeded random order (so that the first few are a fair sample),
/// without matches that are not finite.
class PointMatches {
 public:
  PointMatches(const std::vector<Eigen::Vector3d>& bearings_in_camera,
               const std::vector<Eigen::Vector3d>& points_in_map, std::uint64_t seed);

  int size() const { return static_cast<int>(source_.size()); }
  const VectorArray& bearings() const { return bearings_; }
  const VectorArray& points() const { return points_; }
  int source(int i) const { return source_[i]; }  // index in the vectors this was made of

 private:
  VectorArray bearings_, points_;
  std::vector<int> source_;
};

using CameraPose = Motion;  // camera_from_map

/// MSAC: the sum of min(e^2, threshold^2) over angles e (radians) between bearings and points; points behind
/// the camera are outliers. Gives up with an infinite cost when it exceeds cost_bound or is all but sure to.
/// inliers, if given, gets a flag a match. log_odds: of rejecting a pose as good as the bound (is_hopeless).
/// Here 1 in 20, as scoring dominates the time where nearly all matches are outliers. This costs 5 % more
/// samples and halves their scoring time (Chum and Matas, Optimal randomized RANSAC, 2008).
RansacScore score_camera_pose(const PointMatches& matches, const CameraPose& pose, double threshold,
                              double cost_bound, std::vector<char>* inliers = nullptr, double log_odds = 3);

/// Levenberg-Marquardt over the truncated squares of the angles; matches beyond the threshold at an iteration
/// have no say in it. The truncated cost never grows.
void refine_camera_pose(const PointMatches& matches, double threshold, int max_iterations, CameraPose* pose);

/// Escapes a local minimum: refine_camera_pose with a threshold `widening` times as wide, then with the
/// threshold. Keeps the given pose unless that lowers the truncated cost.
void widen_camera_pose(const PointMatches& matches, double threshold, double widening, int max_iterations,
                       CameraPose* pose);

/// refine_camera_pose with the threshold that the errors' noise suggests; leaves the pose, where matches
/// beyond the threshold are more than noise explains.
void polish_camera_pose(const PointMatches& matches, double threshold, int max_iterations, CameraPose* pose);

}  // namespace mono_pose_tracker
