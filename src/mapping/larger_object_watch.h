#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "common/last_time.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Asks of a live map, at most once every 0.4 s, whether more moves as one otherwise than as it says: where
/// it is of a room, say, seen past a larger thing that turns before the camera. The same that
/// IndependentMotion::is_larger asks of a finished map.
class LargerObjectWatch {
 public:
  /// After the newest keyframe has come into the map: what it and the one before it show.
  void ask(const Map& map, const MatchOptions& matching, const RansacOptions& ransac);
  /// Empty: nothing.
  const std::string& doubt() const { return doubt_; }
  void reset() { *this = LargerObjectWatch(); }

 private:
  struct Seen {
    std::int64_t of_map = 0, of_other = 0;  // matches that obey one of the two motions only
  };

  LastTime asked_;         // by the stamps of newest keyframes
  std::deque<Seen> seen_;  // in the latest pairs
  std::string doubt_;
};

}  // namespace mono_pose_tracker
