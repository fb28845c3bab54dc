#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// What the adjustment of these keyframes, as it stands, leaves open of where each is: its covariance, of the
/// movement x' = exp(w) x + v in the camera's frame (order v, w; map units and radians), marginal over points
/// and the other keyframes (Triggs et al. 1999, section 9). The noise is taken from the residuals.
///
/// Other keyframes that see the same points are held, at most max_fixed of them: so it says nothing of what
/// is uncertain in those. Where there are fewer than two, nothing is held, and it is about the keyframes' own
/// middle, direction and size: errors of all alike are none, as after one similarity for all.
///
/// At most max_landmarks of each keyframe are used, those that most keyframes see. Empty where there is not
/// more to fit than to be fitted.
std::map<KeyframeId, Eigen::Matrix<double, 6, 6>> keyframe_covariances(
    const std::vector<KeyframeId>& keyframes, int max_fixed, int max_landmarks, const Map& map);

}  // namespace mono_pose_tracker
