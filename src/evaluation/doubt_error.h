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

/// Whether wrong poses were reported as doubtful. `reference`: better poses of the same images, with the same
/// stamps, such as the offline result; images without one are left out. Each map is laid over it,
/// orientations apart from positions, by a fit with Huber's loss, in which wrong poses have little say. Maps
/// of fewer than ten poses are left out. Sorted by stamp.
std::vector<PoseDeviation> deviations_of(const std::vector<StampedPose>& reference,
                                         const std::vector<ReportedPose>& reported);

}  // namespace mono_pose_tracker
