#pragma once

#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// The default options without time limits, as for recordings. With a limit, a bundle adjustment on a busy
/// machine ends early and the result changes.
inline TrackerOptions unhurried_options() {
  TrackerOptions options;
  options.mapping.bundle_seconds = 1e9;
  return options;
}

}  // namespace mono_pose_tracker
