#pragma once

#include <map>
#include <vector>

#include "mapping/initial_map.h"
#include "mapping/motion_watch.h"
#include "mapping/static_overlay.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Independently moving features of a growing map: excludes them, and watches whether the map is of the right
/// object. Owned by the map's Atlas; used by the mapper's thread.
///
///     MapMotions motions(options);
///     motions.add(id, frame);
///     motions.separate(options, 2, id, &map);
///     if (motions.is_excluded(id, feature)) ...
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
  void exclude_static_overlay(const MapperOptions& options, const StaticOverlayOptions& overlay,
                              KeyframeId id, Map* map);
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
