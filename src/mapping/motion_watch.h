#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/motion_segmentation.h"
#include "mapping/static_background.h"

namespace mono_pose_tracker {

/// Judges the motions in a growing map as those of a finished one (MotionEvidence, StaticSegmentation), by
/// its first and newest keyframes. Owned by the Mapper; used by its thread.
///
///     MotionWatch watch(options);
///     watch.begin(images_of_the_first_view);
///     watch.add_image(newest, object_turns);
///     watch.add_pair(before, newest, compare_motions(before, newest, options), object_turns);
///     if (watch.object()) ...
class MotionWatch {
 public:
  explicit MotionWatch(MotionSegmentationOptions options = {}) : options_(std::move(options)) {}

  /// A map begins with these unmasked images: the next ones are checked for a static background behind a
  /// moving object. A background found later does not end a map.
  void begin(const std::vector<SeenImage>& images);
  bool checks_background() const { return background_.has_value(); }
  void end_background() { background_.reset(), moving_.reset(); }
  /// An unmasked image has become a keyframe. object_turns: the object that rotates is wanted.
  void add_image(const SeenImage& newest, bool object_turns);
  /// The newest keyframe and one before it. object_turns: the object that rotates is wanted, otherwise the
  /// largest.
  void add_pair(const RegisteredImage& before, const RegisteredImage& newest, const PairMotions& pair,
                bool object_turns);

  /// The object that the map should be of, in the newest keyframe that shows it; null: none is certain.
  const std::shared_ptr<const TurningObject>& object() const { return moving_ ? moving_ : turning_; }
  /// The evidence against the map as text; empty: none.
  std::string doubt() const;

 private:
  MotionSegmentationOptions options_;
  std::optional<StaticSegmentation> background_;           // of a young map
  std::deque<MotionEvidence> newest_;                      // of the latest pairs
  std::shared_ptr<const TurningObject> moving_, turning_;  // before a static background; by its rotation
  double other_share_ = 0;  // of the matches, where the other object is the larger one
};

}  // namespace mono_pose_tracker
