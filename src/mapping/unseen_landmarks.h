#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/projection_matcher.h"

namespace mono_pose_tracker {

// Of these landmarks, those that would be in view of the keyframe and that it does not see yet, each as the
// observation had it that is nearest in direction.
std::vector<LandmarkCandidate> unseen_in_view(const Map& map, const Keyframe& keyframe,
                                              const std::vector<LandmarkId>& landmarks);

}  // namespace mono_pose_tracker
