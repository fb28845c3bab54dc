#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {

/// Where a node (a keyframe, or a map among maps) stands.
struct PoseGraphNode {
  Sim3 map_from_node;
  bool fixed = false;
};

/// A node seen from another: measured is from_from_to, that is, map_from_to = map_from_from * measured.
/// Between keyframes whose common points say so, its scale is 1: drift of scale is what the others then
/// share.
struct PoseGraphEdge {
  int from = -1, to = -1;
  Sim3 measured;
  /// One over the standard deviations of turn (rad), shift (units of the node `from`) and log scale.
  double turn_weight = 1, shift_weight = 1, scale_weight = 1;
};

struct PoseGraph {
  std::vector<PoseGraphNode> nodes;
  std::vector<PoseGraphEdge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 100;
  double function_tolerance = 1e-8;
  std::function<bool()> cancel;  // asked after every iteration; true ends the solve with the best so far

  /// Throws std::invalid_argument naming key, value and range.
  void validate() const;
};

struct PoseGraphReport {
  bool usable = false;  // else the graph is as before
  bool cancelled = false;
  double initial_cost = 0;
  double final_cost = 0;
  int iterations = 0;
};

/// Pose graph over similarities (Strasdat, Montiel and Davison, "Scale drift-aware large scale monocular
/// SLAM", RSS 2010) with Ceres, sparse Cholesky, one thread: same bytes for the same graph. With no node
/// fixed the first stays. A node that no edge ties to a fixed one, directly or through others, stays. Throws
/// std::invalid_argument when an edge names a node that is not there, or has a weight that is not above 0.
PoseGraphReport adjust_pose_graph(const PoseGraphOptions& options, PoseGraph* graph);

}  // namespace mono_pose_tracker
