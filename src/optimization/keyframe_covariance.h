#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// How uncertain the adjustment of these keyframes leaves each of their poses: the covariance of the movement
/// x' = exp(w) x + v in the camera's frame (order v, w; map units and radians), marginal over points and the
/// other keyframes (Triggs et al. 1999, section 9). The noise is estimated from the residuals.
///
/// Other keyframes that see the same points are held fixed, at most max_fixed of them: their own uncertainty
/// is not included. Where there are fewer than two, nothing is held, and the covariance is relative to the
/// keyframes' own middle, orientation and size: what one similarity of them all would undo is no error.
///
/// At most max_landmarks of each keyframe are used, those that most keyframes see. Empty unless there are
/// more residuals than unknowns.
std::map<KeyframeId, Eigen::Matrix<double, 6, 6>> keyframe_covariances(
    const std::vector<KeyframeId>& keyframes, int max_fixed, int max_landmarks, const Map& map);

}  // namespace mono_pose_tracker
