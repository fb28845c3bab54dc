#pragma once

#include <memory>
#include <vector>

#include "map/turning_object.h"
#include "mapping/static_background.h"

namespace mono_pose_tracker {

/// Whether a young map is of what moves and of a background that stands still: what a finished map is asked,
/// asked of the first keyframes as they come. What is seen to stand still later does not end a map.
class StaticBackgroundWatch {
 public:
  /// A map begins with these images.
  void begin(const std::vector<SeenImage>& views, const MatchOptions& matching);
  /// Whether the next keyframe is asked.
  bool watches() const { return watches_; }
  /// A whole image has become a keyframe.
  void note(const SeenImage& newest, const MatchOptions& matching, bool object_turns);
  /// What moves in the newest one, once it is certain; null: nothing stands still behind it.
  const std::shared_ptr<const TurningObject>& found() const { return found_; }
  void reset() { *this = StaticBackgroundWatch(); }

 private:
  void add(const SeenImage& image, const MatchOptions& matching);

  bool watches_ = false;
  std::vector<SeenImage> images_;  // in time
  MatchesInTime in_time_;          // of each with the next
  std::shared_ptr<const TurningObject> found_;
};

}  // namespace mono_pose_tracker
