#pragma once

#include <vector>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/feature_walk.h"

namespace mono_pose_tracker {

/// What a map costs at a size.
struct GrowthStep {
  int keyframes = 0, landmarks = 0;
  double keyframe_ms = 0;      // CPU time of mapping one, mean of the last 50
  double publish_ms = 0;       // of a snapshot after an edit of one keyframe and its landmarks
  double finish_s = 0;         // CPU time of finish() but for its adjustments; 0: not asked
  double global_adjust_s = 0;  // CPU time of one adjustment of the whole map; 0: not asked
};

/// A walk mapped by its features alone, each frame a keyframe that is kept; at `sizes` (ascending) it is told
/// what mapping costs there. `finish_up_to`: finish() is measured on copies of maps no larger.
std::vector<GrowthStep> run_growth_study(const FeatureWalk& walk, const CameraModel& camera,
                                         TrackerOptions options, const std::vector<int>& sizes,
                                         int finish_up_to);

}  // namespace mono_pose_tracker
