#pragma once

#include <memory>
#include <vector>

#include "map/turning_object.h"
#include "mapping/static_background.h"

namespace mono_pose_tracker {

/// Watches whether a young map contains both a moving object and a static background: the check of a finished
/// map, on the first keyframes as they come. A background found later does not end a map.
class StaticBackgroundWatch {
 public:
  /// A map begins with these images.
  void begin(const std::vector<SeenImage>& views, const MatchOptions& matching);
  /// Whether the next keyframe is checked.
  bool watches() const { return watches_; }
  /// An unmasked image has become a keyframe.
  void note(const SeenImage& newest, const MatchOptions& matching, bool object_turns);
  /// The moving object in the newest keyframe, once it is certain; null: there is no static background behind
  /// it.
  const std::shared_ptr<const TurningObject>& found() const { return found_; }
  void reset() { *this = StaticBackgroundWatch(); }

 private:
  void add(const SeenImage& image, const MatchOptions& matching);

  bool watches_ = false;
  std::vector<SeenImage> images_;  // in the order of time
  MatchesInTime in_time_;          // matches of each image with the next
  std::shared_ptr<const TurningObject> found_;
};

}  // namespace mono_pose_tracker
