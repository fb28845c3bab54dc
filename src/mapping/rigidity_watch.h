#pragma once

#include <string>

#include "common/last_time.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Checks the newest keyframes of a live map for reprojection inconsistency (reprojection_inconsistency.h)
/// and rigidity (rigidity_check.h), at most once a second.
class RigidityWatch {
 public:
  /// Called after a keyframe was inserted.
  void ask(const Map& map, const MatchOptions& matching);
  /// The finding of the last check as text; empty: none.
  const std::string& doubt() const { return doubt_; }
  void reset() { *this = RigidityWatch(); }

 private:
  LastTime asked_;  // stamps of the newest keyframes
  std::string doubt_;
};

}  // namespace mono_pose_tracker
