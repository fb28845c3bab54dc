#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Covariance of the pose of each of these keyframes after the adjustment: of the motion x' = exp(w) x + v in
/// the camera's frame (order v, w; map units and radians), marginal over points and the other keyframes
/// (Triggs et al. 1999, section 9). The noise is estimated from the residuals.
///
/// Other keyframes with the same points are held fixed, at most max_fixed of them; their own uncertainty is
/// not included. With fewer than two of them nothing is fixed, and the covariance is relative to the
/// keyframes' own centroid, orientation and size: errors that a common similarity would undo do not count.
///
/// At most max_landmarks of each keyframe are used, those with the most observations. Empty unless there are
/// more residuals than unknowns.
std::map<KeyframeId, Eigen::Matrix<double, 6, 6>> keyframe_covariances(
    const std::vector<KeyframeId>& keyframes, int max_fixed, int max_landmarks, const Map& map);

}  // namespace mono_pose_tracker
