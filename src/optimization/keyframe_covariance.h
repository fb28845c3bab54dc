#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Joint covariance of the poses of some keyframes.
struct JointCovariance {
  std::vector<KeyframeId> keyframes;
  Eigen::MatrixXd covariance;  // six rows of each, in that order: of w, then v
};

/// Covariance of the poses of these keyframes after the adjustment: of the motion x' = exp(w) x + v in
/// the camera's frame (map units and radians), marginal over points (Triggs et al. 1999, section 9). The noise is estimated from the residuals.
///
/// Other keyframes with the same points are held fixed, at most max_fixed of them; their own uncertainty is
/// not included. With fewer than two of them nothing is fixed, and the covariance is relative to the
/// keyframes' own centroid, orientation and size: errors that a common similarity would undo do not count.
///
/// At most max_landmarks of each keyframe are used, those with the most observations. Nothing unless there are
/// more residuals than unknowns and these are determined.
std::optional<JointCovariance> joint_keyframe_covariance(const std::vector<KeyframeId>& keyframes,
                                                         int max_fixed, int max_landmarks, const Map& map);

/// The covariance of each keyframe by itself, marginal over the others; order v, w. Empty for nothing.
std::map<KeyframeId, Eigen::Matrix<double, 6, 6>> keyframe_covariances(
    const std::vector<KeyframeId>& keyframes, int max_fixed, int max_landmarks, const Map& map);

}  // namespace mono_pose_tracker
