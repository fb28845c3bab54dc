#pragma once

#include <vector>

#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// Where a frame was found, by a keyframe's own descriptors.
struct FoundPlace {
  KeyframeId keyframe;
  RegistrationReport report;
};

// Whether another of the places explains the frame nearly as well as the best does, and elsewhere: one door
// of a row for another. Which of them it is, the frame cannot tell. What the map has twice because it drifted
// is one place.
bool has_alias(const TrackingMap& map, const CameraModel& camera, const std::vector<FoundPlace>& places,
               const FoundPlace& best);

}  // namespace mono_pose_tracker
