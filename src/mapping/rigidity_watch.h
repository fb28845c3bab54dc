#pragma once

#include <string>

#include "common/last_time.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Asks of a live map, once a second at most, what is asked of a finished one: whether its newest keyframes
/// contradict each other (contradiction.h) or parts of what they see do (rigidity_check.h).
class RigidityWatch {
 public:
  /// After the newest keyframe has come into the map.
  void ask(const Map& map, const MatchOptions& matching);
  /// What was found the last time; empty: nothing.
  const std::string& doubt() const { return doubt_; }
  void reset() { *this = RigidityWatch(); }

 private:
  LastTime asked_;  // by the stamps of newest keyframes
  std::string doubt_;
};

}  // namespace mono_pose_tracker
