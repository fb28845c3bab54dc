#pragma once

#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "sequence.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// Input of a benchmark; the reference may be empty.
struct RunInput {
  const DecodedSequence& sequence;
  const CameraParameters& camera;
  const TrackerOptions& options;
  const std::vector<StampedPose>& reference;
};

/// Processes every frame in order, with the mapper inline, like track_sequence, and then finishes the map.
/// `trajectory`: the final poses.
Json run_offline(const RunInput& input, std::vector<StampedPose>* trajectory);

/// Feeds frames at `rate_hz` like a camera, whether the tracker is ready or not. `offline`: the result of
/// run_offline with which the poses are compared, or empty. Compared are the reported poses, and those of the
/// last map relative to its final keyframes, without offline refinement.
Json run_live(const RunInput& input, double rate_hz, const std::vector<StampedPose>& offline);

/// The run whose median time of a frame is the median one, with `median_ms_of_runs` beside its figures.
Json median_run(std::vector<Json> runs);

}  // namespace mono_pose_tracker
