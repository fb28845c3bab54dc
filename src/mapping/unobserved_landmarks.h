#pragma once

#include <optional>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Landmarks in view of the keyframe that project within radius_px of one of its features and that it does not
// observe yet. Each candidate has the descriptor of the observation nearest in viewing direction. `landmarks`
// restricts the search (nothing: all). The order is that of `landmarks`, or of the ids.
std::vector<LandmarkCandidate> unobserved_in_view(const Map& map, const Keyframe& keyframe,
                                                  const std::optional<std::vector<LandmarkId>>& landmarks,
                                                  double radius_px);

}  // namespace mono_pose_tracker
