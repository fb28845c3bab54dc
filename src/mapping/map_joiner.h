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

/// A keyframe of one map that was located in another map, and the resulting similarity between the two maps.
/// Each map has its own unit: lengths in `location` are in the other map's unit, and other_from_map.scale
/// converts the keyframe's unit to it.
struct MapMatch {
  KeyframeId keyframe = -1;
  Location location;  // of the keyframe, in the other map
  Sim3 other_from_map;
  double log_scale_sigma = 0;  // standard error of log(other_from_map.scale), no unit
};

/// Nothing when the keyframe is not located at that place of the other map, or when the depths of the common
/// points do not agree on a scale.
std::optional<MapMatch> match_keyframe(const MapperOptions& options, const Map& map, KeyframeId keyframe,
                                       const Map& other, KeyframeId place);

/// Whether the matches of two keyframes agree: the pose from each match reprojects the points of the other
/// within a few pixels.
bool map_matches_agree(const Map& map, const Map& other, const MapMatch& a, const MapMatch& b);

/// The alignment of two maps by keyframes of one that were located in the other.
struct MapAlignment {
  std::vector<MapMatch> map_matches;
  Sim3 other_from_map;
};

/// Nothing when the matches do not agree (map_matches_agree), or when their common points do not determine a
/// similarity by RANSAC over the positions in both maps. The returned similarity is that of the points: a
/// single view of a small planar patch has two nearly equivalent poses, and both keyframes may have the wrong
/// one.
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       MapMatch first, MapMatch second);

/// The same from the view graph: by the verified matches between keyframes of the two maps that are near in
/// time or look similar (`places` of the other map). Nothing when their landmarks do not determine a
/// similarity.
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph);

/// Pairs of landmarks of `map` and `other` (with the ids of each) that are the same by the matches.
std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map,
                                                              const std::vector<MapMatch>& map_matches);

}  // namespace mono_pose_tracker
