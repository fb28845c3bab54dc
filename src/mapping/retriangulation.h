#pragma once

#include <functional>
#include <vector>

#include "mapping/feature_tracks.h"
#include "mapping/graph_consistency.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Features that are not of the map's object.
using IsExcluded = std::function<bool(KeyframeId keyframe, int feature)>;

/// Tracks of the view graph between keyframes of a map, which are numbered in time: connected components of
/// the verified matches, of the edges with most matches first. Inconsistent edges and excluded features have
/// no part.
FeatureTracks graph_tracks(const Map& map, const std::vector<EdgeConsistency>& edges, const ViewGraph& graph,
                           const IsExcluded& is_excluded);

/// Replaces the landmarks by points triangulated from tracks of three or more keyframes that the poses agree
/// with to some px; a landmark keeps its id where its features are on a track. Landmarks of keyframes that
/// fewer than `min_landmarks` of these tracks would constrain stay as well. The map is to be adjusted.
void replace_landmarks(const FeatureTracks& tracks, int min_landmarks, Map* map);

}  // namespace mono_pose_tracker
