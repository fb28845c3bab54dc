#pragma once

#include <string>

#include "mono_pose_tracker/common/last_time.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Checks a live map, once a second at most, as a finished one is checked: whether disjoint parts of the newest
/// keyframes' landmarks give the same poses (rigidity_check.h).
class RigidityWatch {
 public:
  /// After the newest keyframe has come into the map.
  void ask(const Map& map);
  /// What was found the last time; empty: nothing.
  const std::string& doubt() const { return doubt_; }
  void reset() { *this = RigidityWatch(); }

 private:
  LastTime asked_;  // by the stamps of newest keyframes
  std::string doubt_;
};

}  // namespace mono_pose_tracker
