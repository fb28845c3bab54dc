#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/static_overlay.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Similar keyframes of a keyframe, by its id.
using SimilarKeyframes = std::map<KeyframeId, std::vector<KeyframeId>>;

/// The steps that make landmarks of a map from its poses, for the Mapper, the GlobalRefiner and join_maps.
///
///     const TrackExtender tracks(options, excluded, &map);
///     tracks.extend(id);
///     tracks.create_landmarks(id, neighbors(map, id, 8));
///     tracks.cull(map.landmark_ids());
class TrackExtender {
 public:
  /// excluded: features that get no landmark. It and the options must outlive this object.
  TrackExtender(const MapperOptions& options, const FlaggedFeatures& excluded, Map* map)
      : options_(options), excluded_(excluded), map_(*map) {}

  /// Projects landmarks that the target keyframe does not observe into it. A landmark that matches a feature
  /// gains an observation. Where the feature already observes another landmark, the two are merged if both
  /// agree with all of their observations. Without `landmarks`, all of the map.
  void extend(KeyframeId target,
              const std::optional<std::vector<LandmarkId>>& landmarks = std::nullopt) const;
  /// Triangulates new landmarks from features matched along epipolar lines.
  void create_landmarks(KeyframeId newest, const std::vector<KeyframeId>& near) const;
  /// Removes observations with large reprojection errors, then landmarks with a single observation or too
  /// small a parallax.
  void cull(const std::vector<LandmarkId>& landmarks) const;

  /// Landmarks that may be in view of a keyframe; nothing: all. In a map of more than `large_map` keyframes:
  /// landmarks of keyframes connected to it directly or by one between, and of similar keyframes.
  std::optional<std::vector<LandmarkId>> within_reach(KeyframeId id, std::size_t large_map,
                                                      const PlaceFinder& places,
                                                      SimilarKeyframes* known) const;

 private:
  const MapperOptions& options_;
  const FlaggedFeatures& excluded_;
  Map& map_;
};

}  // namespace mono_pose_tracker
