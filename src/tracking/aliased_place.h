#pragma once

#include <vector>

#include "mapping/aliased_places.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// Registration of a frame by the descriptors of one keyframe.
struct FoundPlace {
  KeyframeId keyframe;
  RegistrationReport report;
};

// Whether the best place is ambiguous: another place explains the frame nearly as well with a different pose,
// such as another door of a row. The frame cannot decide between them. Duplicated structure due to drift
// counts as one place.
bool has_alias(const TrackingMap& map, const CameraModel& camera, const std::vector<FoundPlace>& places,
               const FoundPlace& best, const AliasedPlaceOptions& options = {});

}  // namespace mono_pose_tracker
