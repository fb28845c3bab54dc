#pragma once

#include <gtest/gtest.h>

#include <optional>

#include "mapping/keyframe_candidate.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

/// The frame registered against the newest keyframe of a map. All corrections of the map are applied.
inline KeyframeCandidate registered_candidate(const TrackerOptions& options, const CameraModel& camera,
                                              const TrackingMap& map, const Frame& frame) {
  const KeyframeView& newest = map.keyframes.rbegin()->second;
  const RegistrationReport report =
      FrameRegistrar(options, camera).register_frame(frame, map, newest.id, std::nullopt);
  EXPECT_TRUE(report.success) << frame.index << ": " << report.text;
  return {map.map_id,          frame,
          newest.id,           report.camera_from_map * newest.camera_from_map.inverse(),
          report.observations, map.corrections.size()};
}

}  // namespace mono_pose_tracker
