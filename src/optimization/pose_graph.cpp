#include "optimization/pose_graph.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "ceres_solver.h"

namespace mono_pose_tracker {
namespace {

// Parameters of a node: rotation vector (left, from the initial rotation), translation, log scale.
using Block = std::array<double, 7>;
using Quaternion = std::array<double, 4>;  // w first, as Ceres has it

Quaternion to_ceres(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

Block to_block(const Sim3& s) {
  const Eigen::Vector3d& t = s.translation;
  return {0, 0, 0, t.x(), t.y(), t.z(), std::log(s.scale)};
}

Sim3 from_block(const Block& b, const Sim3& start) {
  double q[4];
  ceres::AngleAxisToQuaternion(b.data(), q);
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  return {std::exp(b[6]), (turn * start.rotation).normalized(), Eigen::Vector3d(b[3], b[4], b[5])};
}

// Residual of an edge: rotation, translation and log scale between its measured and its present end, in the
// frame of its start.
struct EdgeError {
  Quaternion from_start, to_start, measured_inverse;
  Eigen::Vector3d shift;
  double log_scale = 0;
  double turn_weight = 1, shift_weight = 1, scale_weight = 1;

  EdgeError(const PoseGraphEdge& edge, const PoseGraph& graph)
      : from_start(to_ceres(graph.nodes[edge.from].map_from_node.rotation)),
        to_start(to_ceres(graph.nodes[edge.to].map_from_node.rotation)),
        measured_inverse(to_ceres(edge.measured.rotation.conjugate())),
        shift(edge.measured.translation),
        log_scale(std::log(edge.measured.scale)),
        turn_weight(edge.turn_weight),
        shift_weight(edge.shift_weight),
        scale_weight(edge.scale_weight) {}

  template <typename T>
  static void rotation(const T* block, const Quaternion& start, T* q) {
    const T from[4] = {T(start[0]), T(start[1]), T(start[2]), T(start[3])};
    T turn[4];
    ceres::AngleAxisToQuaternion(block, turn);
    ceres::QuaternionProduct(turn, from, q);
  }

  template <typename T>
  bool operator()(const T* from, const T* to, T* residual) const {
    T q_from[4], q_to[4], q_between[4], error[4];
    rotation(from, from_start, q_from);
    rotation(to, to_start, q_to);
    const T from_inverse[4] = {q_from[0], -q_from[1], -q_from[2], -q_from[3]};
    ceres::QuaternionProduct(from_inverse, q_to, q_between);
    const T measured[4] = {T(measured_inverse[0]), T(measured_inverse[1]), T(measured_inverse[2]),
                           T(measured_inverse[3])};
    ceres::QuaternionProduct(measured, q_between, error);
    ceres::QuaternionToAngleAxis(error, residual);
    const T apart[3] = {to[3] - from[3], to[4] - from[4], to[5] - from[5]};
    T in_from[3];
    ceres::UnitQuaternionRotatePoint(from_inverse, apart, in_from);
    const T shrink = exp(-from[6]);
    for (int i = 0; i < 3; ++i) {
      residual[i] *= turn_weight;
      residual[3 + i] = shift_weight * (shrink * in_from[i] - shift[i]);
    }
    residual[6] = scale_weight * (to[6] - from[6] - log_scale);
    return true;
  }
};

bool is_sound(const Sim3& s) {
  return std::isfinite(s.scale) && s.scale > 0 && s.rotation.coeffs().allFinite() &&
         s.translation.allFinite();
}

void check(const PoseGraph& graph) {
  const int size = static_cast<int>(graph.nodes.size());
  for (const PoseGraphNode& node : graph.nodes) {
    if (!is_sound(node.map_from_node))
      throw std::invalid_argument("pose graph: a node is not a valid similarity transform");
  }
  for (const PoseGraphEdge& e : graph.edges) {
    if (e.from < 0 || e.from >= size || e.to < 0 || e.to >= size || e.from == e.to) {
      throw std::invalid_argument("pose graph: an edge from node " + std::to_string(e.from) + " to " +
                                  std::to_string(e.to) + " of " + std::to_string(size));
    }
    if (!is_sound(e.measured))
      throw std::invalid_argument("pose graph: an edge is not a valid similarity transform");
    for (const double weight : {e.turn_weight, e.shift_weight, e.scale_weight}) {
      if (!(weight > 0) || !std::isfinite(weight)) {
        throw std::invalid_argument("pose graph: an edge's weight is " + std::to_string(weight) +
                                    ", expected > 0");
      }
    }
  }
}

// Flags of the nodes that edges connect to one of the held nodes, directly or through others.
std::vector<char> connected_to(std::vector<char> held, const PoseGraph& graph) {
  std::vector<std::vector<int>> neighbors(graph.nodes.size());
  for (const PoseGraphEdge& e : graph.edges) {
    neighbors[e.from].push_back(e.to);
    neighbors[e.to].push_back(e.from);
  }
  std::vector<int> open;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (held[i]) open.push_back(static_cast<int>(i));
  }
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    for (const int next : neighbors[node]) {
      if (!held[next]) open.push_back(next);
      held[next] = 1;
    }
  }
  return held;
}

std::vector<char> held_nodes(const PoseGraph& graph) {
  std::vector<char> held;
  bool any = false;
  for (const PoseGraphNode& node : graph.nodes) {
    held.push_back(node.fixed);
    any = any || node.fixed;
  }
  if (!any && !held.empty()) held.front() = 1;
  return held;
}

ceres::Solver::Summary solve(const PoseGraphOptions& options, const PoseGraph& graph, CancelCallback* cancel,
                             std::vector<Block>* blocks) {
  const std::vector<char> held = held_nodes(graph), connected = connected_to(held, graph);
  ceres::Problem problem;
  std::vector<char> used(graph.nodes.size(), 0);
  for (const PoseGraphEdge& e : graph.edges) {
    if (!connected[e.from]) continue;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeError, 7, 7, 7>(new EdgeError(e, graph)),
                             nullptr, (*blocks)[e.from].data(), (*blocks)[e.to].data());
    used[e.from] = used[e.to] = 1;
  }
  for (std::size_t i = 0; i < blocks->size(); ++i) {
    if (used[i] && held[i]) problem.SetParameterBlockConstant((*blocks)[i].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.max_trust_region_radius = kMaxTrustRegionRadius;
  solver.logging_type = ceres::SILENT;
  silence_solver_log();
  if (options.cancel) solver.callbacks.push_back(cancel);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary;
}

}  // namespace

void PoseGraphOptions::validate() const {
  const auto check = [](bool ok, const char* key, double value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string("pose graph: ") + key + " = " + std::to_string(value) +
                                  ", expected " + range);
  };
  check(max_iterations >= 1, "max_iterations", max_iterations, ">= 1");
  check(function_tolerance >= 0, "function_tolerance", function_tolerance, ">= 0");
}

PoseGraphReport adjust_pose_graph(const PoseGraphOptions& options, PoseGraph* graph) {
  options.validate();
  check(*graph);
  PoseGraphReport report;
  if (graph->edges.empty()) return report;
  std::vector<Block> blocks;
  for (const PoseGraphNode& node : graph->nodes) blocks.push_back(to_block(node.map_from_node));
  CancelCallback cancel(options.cancel);
  const ceres::Solver::Summary summary = solve(options, *graph, &cancel, &blocks);
  report.initial_cost = summary.initial_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  report.final_cost = summary.final_cost;
  report.cancelled = cancel.cancelled();
  report.usable = summary.IsSolutionUsable();
  for (std::size_t i = 0; report.usable && i < blocks.size(); ++i) {
    report.usable = is_sound(from_block(blocks[i], graph->nodes[i].map_from_node));
  }
  if (!report.usable) return report;
  const std::vector<char> held = held_nodes(*graph), connected = connected_to(held, *graph);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Sim3& node = graph->nodes[i].map_from_node;
    if (connected[i] && !held[i]) node = from_block(blocks[i], node);
  }
  return report;
}

}  // namespace mono_pose_tracker
