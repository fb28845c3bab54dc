#pragma once

#include <functional>
#include <vector>

#include "mapping/graph_consistency.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Features of a keyframe that are masked.
using IsLeftOut = std::function<bool(KeyframeId keyframe, int feature)>;

/// Replaces all landmarks of a map by the tracks of the view graph, and adjusts it. The landmarks of a map
/// were matched and culled by its own poses, so a wrong map agrees with itself. The tracks do not depend on
/// the poses: they are the connected components of the verified matches of all edges that are not
/// inconsistent, the edges of the nearest keyframes first. A track of three views or more is triangulated by
/// its first and last view; one that lies beyond 10 px (at 640 px) of any of its features is dropped. False,
/// and the map stays as it is, where a keyframe would be left with fewer than min_landmarks. Bundle
/// adjustment begins with a loss ten times as wide, so that what disagrees pulls too (Triggs 1999, 4.3).
bool retriangulate(const BundleOptions& bundle, const ViewGraph& graph,
                   const std::vector<EdgeConsistency>& edges, const IsLeftOut& is_left_out, int min_landmarks,
                   Map* map);

}  // namespace mono_pose_tracker
