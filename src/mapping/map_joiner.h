#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "map/place_finder.h"
#include "mapping/keyframe_locator.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// A keyframe of one map found in another, and the similarity that this makes between the two. Each map has a
/// unit of its own: lengths in `location` are in the other's, and other_from_map.scale is the length in the
/// other's units of what is 1 in the keyframe's own.
struct MapMatch {
  KeyframeId keyframe = -1;
  Location location;  // of the keyframe, in the other map
  Sim3 other_from_map;
  double log_scale_sigma = 0;  // standard error of log(other_from_map.scale), no unit
};

/// Nothing when the keyframe is not found at that place of the other map, or the depths of the points that
/// both maps know don't agree on a scale.
std::optional<MapMatch> match_keyframe(const MapperOptions& options, const Map& map, KeyframeId keyframe,
                                       const Map& other, KeyframeId place);

/// Whether two ties of different keyframes say the same: the pose that each gives the other's keyframe shows
/// what was found there within a few pixels.
bool map_matches_agree(const Map& map, const Map& other, const MapMatch& a, const MapMatch& b);

/// Two maps where they meet: two keyframes of one, found in the other.
struct MapAlignment {
  std::vector<MapMatch> map_matches;
  Sim3 other_from_map;
};

/// Nothing when the ties do not agree (map_matches_agree), or the points that they share do not determine a
/// similarity by RANSAC over where both maps have them. It is that one which holds: of a small patch of a
/// wall a single view has two poses that show it all but alike, and both keyframes may have taken the wrong
/// one.
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       MapMatch first, MapMatch second);

/// The same from the view graph: by the verified matches between keyframes of the two maps that are near in
/// time, or that look like each other (`places` of the other map). Nothing when their landmarks do not
/// determine a similarity.
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph);

/// Landmarks of `map` and of `other` (ids as they are there) that the ties say are one.
std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map,
                                                              const std::vector<MapMatch>& map_matches);

}  // namespace mono_pose_tracker
