#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {

/// Pose of a node (a keyframe, or a map among maps).
struct PoseGraphNode {
  Sim3 map_from_node;
  bool fixed = false;
};

/// A measured relative pose: measured is from_from_to, that is, map_from_to = map_from_from * measured. Its
/// scale is 1 between keyframes with common points; the other edges then share the drift of scale.
struct PoseGraphEdge {
  int from = -1, to = -1;
  Sim3 measured;
  /// Inverse standard deviations of rotation (rad), translation (units of the node `from`) and log scale.
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
/// SLAM", RSS 2010) with Ceres, sparse Cholesky, one thread; the result is reproducible bit by bit. Without
/// fixed nodes the first one is fixed. A node without a connection to a fixed one stays. Throws
/// std::invalid_argument when an edge names an unknown node, or has a weight that is not positive.
PoseGraphReport adjust_pose_graph(const PoseGraphOptions& options, PoseGraph* graph);

}  // namespace mono_pose_tracker
