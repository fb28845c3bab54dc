#pragma once

#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// The defaults without a limit of time, as recordings are mapped: with it, a bundle adjustment on a busy
/// machine ends before it has done anything, and the result is another one.
inline TrackerOptions unhurried_options() {
  TrackerOptions options;
  options.mapping.bundle_seconds = 1e9;
  return options;
}

}  // namespace mono_pose_tracker
