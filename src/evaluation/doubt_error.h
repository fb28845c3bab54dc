#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

struct DeviationOptions {
  std::size_t min_poses = 10;  // of a map: a similarity fits fewer too well
  double off = 5;              // medians of the errors, above which a pose is wrong
  int steps = 30;              // of the fits, which settle in a dozen
};

/// A pose as it was reported live.
struct ReportedPose {
  std::int64_t stamp_ns = 0;
  std::uint32_t map_id = 0;  // whose frame and unit it is in
  Rigid3 map_from_camera;
  bool doubtful = false;  // reported as such
};

/// Error of a pose against the reference, after alignment of its map.
struct PoseDeviation {
  std::int64_t stamp_ns = 0;
  double position = 0;  // in the reference's unit
  double rotation_deg = 0;
  bool doubtful = false;
  bool off = false;  // position or rotation error above DeviationOptions::off medians of all
};

/// Evaluates whether wrong poses were reported as doubtful. `reference`: more accurate poses of the same
/// images with equal stamps, such as the offline result; images without one are excluded. Each map is aligned
/// with Huber's loss, orientations apart from positions, so that wrong poses have little influence. Maps with
/// fewer than min_poses are excluded. Sorted by stamp.
std::vector<PoseDeviation> deviations_of(const std::vector<StampedPose>& reference,
                                         const std::vector<ReportedPose>& reported,
                                         const DeviationOptions& options = {});

}  // namespace mono_pose_tracker
