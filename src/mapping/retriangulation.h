#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "mapping/feature_tracks.h"
#include "mapping/graph_consistency.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct RetriangulationOptions {
  std::size_t min_views = 3;  // of a track: two can be inconsistent in one direction only
  // px at 640 px (image_scale), reprojection error with the current poses. Wrong matches have tens of px;
  // poses that are off by a degree or two displace right ones by several.
  double max_error_px = 10;
};

/// Whether a feature is not part of the mapped object.
using IsExcluded = std::function<bool(KeyframeId keyframe, int feature)>;

/// Tracks of the view graph between keyframes of a map, which are numbered in time: connected components of
/// the verified matches, starting with the edges that have most matches. Inconsistent edges and excluded
/// features are ignored.
FeatureTracks graph_tracks(const Map& map, const std::vector<EdgeConsistency>& edges, const ViewGraph& graph,
                           const IsExcluded& is_excluded);

/// Replaces the landmarks by points triangulated from tracks of three or more keyframes whose reprojection
/// errors are a few px at most. A landmark keeps its id where its features are on a track. Landmarks of
/// keyframes with fewer than `min_landmarks` of these tracks stay as well. The map needs a bundle adjustment
/// afterwards.
void replace_landmarks(const FeatureTracks& tracks, int min_landmarks, Map* map);

}  // namespace mono_pose_tracker
