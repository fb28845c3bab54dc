#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/mapper_input.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/feature_walk.h"

namespace mono_pose_tracker {

/// Accuracy of a loop closure against the truth.
struct StudiedLoop {
  int from_frame = -1, to_frame = -1;
  double apart = 0;  // m, true distance of the two cameras
  // Position error of the newest keyframe after alignment of the first third of the map, as share of the
  // path: before and after the loop closure.
  double drift_before = 0, drift_after = 0;
};

struct LoopStudy {
  int frames_posed = 0, frames = 0, keyframes = 0;
  std::vector<StudiedLoop> loops;
  // Largest distance of a frame from the position predicted by the previous motion, in steps of the walk.
  // Detects corrections that do not update the motion model.
  double worst_prediction = 0;
  double position_rmse = 0;     // of all keyframes after a similarity, of the way
  double limit_rmse = 0;        // the same of bundle adjustment of all that they see, started from the truth
  double search_seconds = 0;    // CPU time of all searches for loops
  double map_seconds = 0;       // CPU time of all else that the mapper did
  double slowest_search_s = 0;  // of one keyframe
};

/// The first two frames, with their common points at the true positions.
InitialMap true_beginning(const FeatureWalk& walk, const CameraModel& camera, double noise_px,
                          Random& random);

/// Tracks and maps a walk by its features alone, like a recording: each frame is registered in the present
/// map (absolute pose, predicted by the last motion) and becomes a keyframe. `close_loops` false: without
/// loop closure, for comparison. find_limit: computes limit_rmse. Walk, options and seed determine all
/// results except times.
LoopStudy run_loop_study(const FeatureWalk& walk, const CameraModel& camera, const TrackerOptions& options,
                         double noise_px, std::uint64_t seed, bool close_loops, bool find_limit = false);

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
