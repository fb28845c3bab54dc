#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "map/frame_poses.h"
#include "mapping/motion_segmentation.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/quality/quality_report.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "quality/path_precision.h"

namespace mono_pose_tracker {

/// What is known of an object other than the mapped one that may be the wanted one.
enum class OtherObject {
  kNone,
  kMayBeTurning,  // segmentation/body asks for the object that rotates, and that may be the other one
  // The largest object is asked for, and the other one is
  kLarger,      // larger
  kComparable,  // not much smaller
  kRotatesMore  // smaller, but it rotates plainly more before a map that stays in view: a head above
                // shoulders
};

/// One of the maps of a finished recording.
struct FinishedMap {
  std::uint32_t id = 0;
  std::vector<RegisteredFrame> trajectory;
  /// Frames of the trajectory with an uncertain pose: DOUBTFUL_POSE.
  std::set<std::int64_t> doubtful;
  RegisteredLandmarks registered;  // landmarks by which the images of the trajectory were registered
  Map map;
  PathPrecision precision;
  std::shared_ptr<const MapSnapshot> snapshot;
  /// The findings about the map and the verdict.
  QualityReport quality;
  ExplainedMatches explained;            // verified matches of the view graph that the map explains
  IndependentMotion independent_motion;  // another rigid motion in its images
  OtherObject other_object = OtherObject::kNone;
  /// Tracks of the mapped object and of independent motions, where segmentation/body asks for the object that
  /// rotates.
  std::vector<MotionTrack> object_tracks;
  /// The images show a static background that no mask has separated from the moving object.
  bool shows_background = false;

  bool confirmed() const { return quality.confirmed(); }
  /// Whether the map was loaded from a file: frames of earlier runs have negative indices.
  bool is_loaded() const {
    const auto& keyframes = map.keyframes();
    return !keyframes.empty() && is_of_earlier_run(keyframes.begin()->second.frame_index);
  }
};

}  // namespace mono_pose_tracker
