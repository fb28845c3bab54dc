#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

struct DoubtfulFramesOptions {
  double steps = 3;          // error of a doubtful pose, in steps between images. An estimate: measured wrong
                             // poses had one to three
  double most_share = 0.25;  // of all frames: consecutive doubtful poses propagate their error
  std::int64_t near = 4;  // images before and after, of which two others confirm a pose; half of them may be
                          // blurred
};

// Frames of which at most one image next to them has a pose as well: no third view confirms their place,
// which repeated structure may have elsewhere, and the images that show the same were not registered there.
std::set<std::int64_t> isolated_frames(const std::vector<RegisteredFrame>& trajectory,
                                       const DoubtfulFramesOptions& options = {});

// Frames of the trajectory with doubtful poses, without those between two certain poses: their errors are
// small, or they were detected as outliers.
std::vector<std::int64_t> doubtful_alone(const std::vector<RegisteredFrame>& trajectory,
                                         const std::set<std::int64_t>& doubtful);

// Whether this number of doubtful poses may distort the path by more than the uncertainty of a known path
// (quality/path_precision.h).
bool may_distort_path(std::size_t doubtful, std::size_t registered,
                      const DoubtfulFramesOptions& options = {});

}  // namespace mono_pose_tracker
