#include "view_graph_files.h"

#include <algorithm>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "io/files.h"
#include "io/plot.h"
#include "mapping/graph_consistency.h"
#include "tools/json.h"

namespace mono_pose_tracker {

namespace {

std::map<ViewGraph::Pair, EdgeConsistency> edges_of(const ViewGraph& graph, const Map& map) {
  GraphConsistencyOptions all;
  all.min_inliers = 1;
  std::map<ViewGraph::Pair, EdgeConsistency> edges;
  for (const EdgeConsistency& edge : edge_consistency(map, graph, all)) edges.emplace(edge.pair, edge);
  return edges;
}

cv::Scalar color_of(double explained_share) {
  constexpr double kFull = 210;
  return {0, kFull * explained_share, kFull * (1 - explained_share)};  // BGR
}

}  // namespace

void write_view_graph(const std::string& path, const ViewGraph& graph, const Map& map) {
  const std::map<ViewGraph::Pair, EdgeConsistency> edges = edges_of(graph, map);
  write_file_atomically(path, [&](std::ostream& out) {
    for (const auto& [pair, geometry] : graph.edges()) {
      const auto edge = edges.find(pair);
      const Json line = {
          {"frames", {graph.nodes()[pair.first].frame_index, graph.nodes()[pair.second].frame_index}},
          {"type", to_string(geometry.type)},
          {"matches", geometry.matches.size()},
          {"inliers", {geometry.inliers(1), geometry.inliers(2)}},
          {"explained", edge == edges.end() ? Json() : Json(edge->second.explained)}};
      out << line.dump() << '\n';
    }
  });
}

void draw_view_graph(const std::string& path, const ViewGraph& graph, const Map& map) {
  constexpr int kSidePx = 1000;
  const cv::Scalar unknown(190, 190, 190);
  const std::map<ViewGraph::Pair, EdgeConsistency> edges = edges_of(graph, map);
  PlotSeries pairs;
  pairs.radius_px = 3;
  pairs.is_square = true;
  double last = 1;
  for (const auto& [pair, geometry] : graph.edges()) {
    if (geometry.type == TwoViewType::kDegenerate) continue;
    const auto first = static_cast<double>(graph.nodes()[pair.first].frame_index),
               second = static_cast<double>(graph.nodes()[pair.second].frame_index);
    pairs.points.emplace_back(std::min(first, second), std::max(first, second));
    last = std::max({last, first, second});
    const auto edge = edges.find(pair);
    pairs.colors.push_back(
        edge == edges.end() ? unknown
                            : color_of(static_cast<double>(edge->second.explained) / edge->second.matches));
  }
  PlotPanel panel;
  panel.title = "view graph: verified matches explained by the map, none (red) to all (green)";
  panel.x_label = "image";
  panel.y_label = "image";
  panel.x = panel.y = with_margin({0, last}, 0.02);
  panel.equal_axes = true;
  panel.series = {pairs};
  cv::Mat picture(kSidePx, kSidePx, CV_8UC3, cv::Scalar::all(255));
  draw_panel(panel, {0, 0, kSidePx, kSidePx}, &picture);
  write_picture(path, picture);
}

}  // namespace mono_pose_tracker
