#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

/// A pose as it was reported live.
struct ReportedPose {
  std::int64_t stamp_ns = 0;
  std::uint32_t map_id = 0;  // whose frame and unit it is in
  Rigid3 map_from_camera;
  bool doubtful = false;  // reported as such
};

/// Where a pose lies beside the reference, its map laid over it.
struct PoseDeviation {
  std::int64_t stamp_ns = 0;
  double position = 0;  // in the reference's unit
  double rotation_deg = 0;
  bool doubtful = false;
  bool off = false;  // in position or in rotation more than five times the median of all
};

/// Whether poses that are wrong were told to be doubtful. `reference`: better poses of the same images, with
/// the same stamps, as the offline result; what it does not have is left out. Each map is laid over it, its
/// orientations apart from its positions, by a fit with Huber's loss: those that are wrong have little say.
/// Maps of fewer than ten poses are left out. By stamp.
std::vector<PoseDeviation> deviations_of(const std::vector<StampedPose>& reference,
                                         const std::vector<ReportedPose>& reported);

}  // namespace mono_pose_tracker
