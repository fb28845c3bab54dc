#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "map/frame_poses.h"
#include "mapping/independent_motion.h"
#include "mapping/path_precision.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/quality/quality_report.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "quality/scale_cut.h"

namespace mono_pose_tracker {

/// One of the maps that a recording ended in.
struct FinishedMap {
  std::uint32_t id = 0;
  std::vector<RegisteredFrame> trajectory;
  RegisteredLandmarks registered;  // what the images of the trajectory were posed by
  Map map;
  std::shared_ptr<const MapSnapshot> snapshot;
  /// What was found out about it, and the verdict.
  QualityReport quality;
  ExplainedMatches explained;            // verified matches of the view graph that it explains
  IndependentMotion independent_motion;  // another rigid motion in its images
  /// segmentation/body asks for the object that turns, and this is another, or may be.
  bool is_of_other_object = false;
  /// The largest object is asked for, and another is larger.
  bool is_of_smaller_object = false;
  /// Another object may as well be what is wanted.
  bool may_be_of_wrong_object = false;
  /// Where segmentation/body asks for the object that turns: tracks of it and of what moves otherwise.
  std::vector<MotionTrack> object_tracks;
  /// Its images show a static background that no mask has told from what moves.
  bool shows_background = false;
  double depth_evidence = 0;     // against the depth-reversed map (mapping/depth_reversal.h)
  double geometry_evidence = 0;  // against the planar alternative (mapping/planar_ambiguity.h)

  bool confirmed() const { return quality.confirmed(); }
};

}  // namespace mono_pose_tracker
