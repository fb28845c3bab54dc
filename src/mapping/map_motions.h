#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/mapper_input.h"
#include "mapping/motion_segmentation.h"
#include "mapping/static_background.h"
#include "mapping/static_overlay.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Judges the motions in a growing map as those of a finished one (MotionEvidence, StaticSegmentation), by
/// its first and newest keyframes. Part of MapMotions; used by the mapper's thread.
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

/// Independently moving features of a growing map: excludes them, and watches whether the map is of the right
/// object. Owned by the map's Atlas; used by the mapper's thread.
///
///     MapMotions motions(options);
///     motions.add(id, frame);
///     motions.separate(options, 2, id, &map);
///     if (is_flagged(motions.excluded(), id, feature)) ...
class MapMotions {
 public:
  explicit MapMotions(const MapperOptions& options = {});

  /// The map begins with these views. Where a mask excludes the static features there is nothing to separate.
  void begin(const MapperOptions& options, const InitialMap& initial);
  /// The frame has become a keyframe.
  void add(KeyframeId id, const Frame& frame);
  void remove(KeyframeId id);

  /// Excludes features with a common motion other than the mapped object's, in the keyframe and one before
  /// it, now and later. partners: number of covisible keyframes to compare.
  void separate(const MapperOptions& options, int partners, KeyframeId id, Map* map);
  /// Excludes static overlay, even where it fits consecutive keyframes.
  void exclude_static_overlay(const MapperOptions& options, KeyframeId id, Map* map);
  /// Removes the landmarks of these features as well.
  void exclude(KeyframeId id, const std::vector<char>& features, Map* map);
  const FlaggedFeatures& excluded() const { return excluded_; }

  /// Watches the background of a young map by its newest frame.
  void watch_background(const MapperOptions& options, const Frame& newest, const Map& map,
                        StageTimes* stages);
  /// Checks that the map is of the largest object. With separates_motions, all pairs are watched already.
  void watch_object(const MapperOptions& options, const Map& map);
  const MotionWatch& watch() const { return watch_; }

 private:
  void watch_pair(const MapperOptions& options, const Keyframe& before, const Keyframe& newest,
                  const PairMotions* known);

  std::map<KeyframeId, ImageFeaturesPtr> unmasked_;  // of keyframes that were inserted with masked features
  FlaggedFeatures excluded_;                         // features with another motion
  MotionWatch watch_;
};

}  // namespace mono_pose_tracker
