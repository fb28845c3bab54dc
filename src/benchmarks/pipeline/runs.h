#pragma once

#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "sequence.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// What is measured; the reference may be empty.
struct RunInput {
  const DecodedSequence& sequence;
  const CameraParameters& camera;
  const TrackerOptions& options;
  const std::vector<StampedPose>& reference;
};

/// Every frame, one after the other, the mapper inline, as track_sequence does it; then the last
/// optimisation. `trajectory`: the final poses.
Json run_offline(const RunInput& input, std::vector<StampedPose>* trajectory);

/// Frames put in at `rate_hz` whether the tracker is ready or not, as a camera does it. `offline`: what
/// run_offline found, with which the poses are compared, or empty: as they came, and all of the last map's as
/// they ride on it at the end, without an offline end.
Json run_live(const RunInput& input, double rate_hz, const std::vector<StampedPose>& offline);

/// The run whose median time of a frame is the median one, with `median_ms_of_runs` beside its figures.
Json median_run(std::vector<Json> runs);

}  // namespace mono_pose_tracker
