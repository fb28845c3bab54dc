#pragma once

#include <memory>
#include <vector>

#include "mono_pose_tracker/map/turning_body.h"
#include "mono_pose_tracker/mapping/still_background.h"

namespace mono_pose_tracker {

/// Whether a map that is being made is of what moves and of a background that stands still at once: the same
/// that is asked of a finished map, of the keyframes as they come.
class BackgroundWatch {
 public:
  /// A whole image that has become a keyframe.
  void note(const SeenImage& newest, const MatchOptions& matching, bool body_turns);
  /// What moves in the newest one, once it is certain; null: nothing stands still behind it.
  const std::shared_ptr<const TurningBody>& found() const { return found_; }
  void reset() { *this = BackgroundWatch(); }

 private:
  std::vector<SeenImage> images_;  // the latest, in time
  MatchesInTime in_time_;          // of each with the next
  std::shared_ptr<const TurningBody> found_;
};

}  // namespace mono_pose_tracker
