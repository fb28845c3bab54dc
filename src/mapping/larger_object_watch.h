#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "common/last_time.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Checks a live map, at most once every 0.4 s, for an independent motion with more features than the mapped
/// object: a larger object that rotates in front of a mapped room, for example. IndependentMotion::is_larger
/// is the same check of a finished map.
class LargerObjectWatch {
 public:
  /// Called after a keyframe was inserted: compares it with the one before.
  void ask(const Map& map, const MatchOptions& matching, const RansacOptions& ransac);
  /// The evidence as text; empty: none.
  const std::string& doubt() const { return doubt_; }
  void reset() { *this = LargerObjectWatch(); }

 private:
  struct Seen {
    std::int64_t of_map = 0, of_other = 0;  // matches that obey only one of the two motions
  };

  LastTime asked_;         // stamps of the newest keyframes
  std::deque<Seen> seen_;  // the latest pairs
  std::string doubt_;
};

}  // namespace mono_pose_tracker
