#pragma once

#include <optional>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Of these landmarks (none given: of all), those that would be in view of the keyframe within so many px of a
// feature of it, and that it does not see yet; each as the observation had it that is nearest in direction.
// In the order of what is given, or of their ids.
std::vector<LandmarkCandidate> unobserved_in_view(const Map& map, const Keyframe& keyframe,
                                                  const std::optional<std::vector<LandmarkId>>& landmarks,
                                                  double radius_px);

}  // namespace mono_pose_tracker
