#pragma once

#include <vector>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/feature_walk.h"

namespace mono_pose_tracker {

/// Cost of mapping at a size of the map.
struct GrowthStep {
  int keyframes = 0, landmarks = 0;
  double keyframe_ms = 0;      // CPU time of mapping one, mean of the last 50
  double publish_ms = 0;       // of a snapshot after an edit of one keyframe and its landmarks
  double finish_s = 0;         // CPU time of finish() but for its adjustments; 0: not asked
  double global_adjust_s = 0;  // CPU time of one adjustment of the whole map; 0: not asked
};

/// Maps a walk by its features alone, each frame a keyframe that is kept, and measures the cost of mapping at
/// `sizes` (ascending). `finish_up_to`: finish() is measured on copies of maps up to this size.
std::vector<GrowthStep> run_growth_study(const FeatureWalk& walk, const CameraModel& camera,
                                         TrackerOptions options, const std::vector<int>& sizes,
                                         int finish_up_to);

}  // namespace mono_pose_tracker
