#pragma once

#include <cstdint>
#include <string>

#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

struct TrackerOptions {
  std::uint64_t seed = 0;
  SiftOptions sift;

  /// Throws std::invalid_argument naming key, value and range.
  void validate() const;
};

}  // namespace mono_pose_tracker
