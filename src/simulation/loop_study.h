#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/initial_map.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/feature_walk.h"

namespace mono_pose_tracker {

/// How a loop came out, against the truth.
struct StudiedLoop {
  int from_frame = -1, to_frame = -1;
  double apart = 0;  // m, true distance of the two cameras
  // Position of the newest keyframe off the truth, once the map is laid on the truth by its first third, of
  // the way: before the loop was closed and after.
  double drift_before = 0, drift_after = 0;
};

struct LoopStudy {
  int frames_posed = 0, frames = 0, keyframes = 0;
  std::vector<StudiedLoop> loops;
  // The farthest that a frame was from where the motion of the one before let it be expected, in steps of the
  // walk: a correction that left the motion behind would show here.
  double worst_prediction = 0;
  double position_rmse = 0;     // of all keyframes after a similarity, of the way
  double limit_rmse = 0;        // the same of bundle adjustment of all that they see, started from the truth
  double search_seconds = 0;    // CPU time of all searches for loops
  double map_seconds = 0;       // CPU time of all else that the mapper did
  double slowest_search_s = 0;  // of one keyframe
};

/// The first two frames, with the points that both see at their true places.
InitialMap true_beginning(const FeatureWalk& walk, const CameraModel& camera, double noise_px,
                          Random& random);

/// A walk tracked and mapped by its features alone, as a recording is: each frame is posed against the map so
/// far (resection predicted by the last motion) and becomes a keyframe. `close_loops` false: for what it
/// would be without. find_limit: limit_rmse is worked out. The same figures for the same walk, options and
/// seed; only times differ.
LoopStudy run_loop_study(const FeatureWalk& walk, const CameraModel& camera, const TrackerOptions& options,
                         double noise_px, std::uint64_t seed, bool close_loops, bool find_limit = false);

}  // namespace mono_pose_tracker
