#pragma once

#include <string>

#include "mapping/view_graph.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// The two-view geometries as JSON lines, an edge each, for debugging and plots: {"frames": [a, b], "type":
/// "calibrated", "matches": n, "inliers": [n1, n2], "explained": k}. inliers: verified matches of the
/// dominant and of the second motion; explained: of those of the map's object, by the map; null where the map
/// does not hold both images. Throws std::runtime_error naming the path when it cannot be written.
void write_view_graph(const std::string& path, const ViewGraph& graph, const Map& map);

/// The same as a picture: a square for each pair of images, from red (the map explains no verified match) to
/// green (it explains all); grey where the map does not hold both images. Throws as above.
void draw_view_graph(const std::string& path, const ViewGraph& graph, const Map& map);

}  // namespace mono_pose_tracker
