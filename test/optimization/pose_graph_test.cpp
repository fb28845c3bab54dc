#include "optimization/pose_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

constexpr int kNodes = 60;
constexpr double kRadius = 10;

// Cameras that walk round a circle and look where they go.
Sim3 truth(int i) {
  const double angle = 2 * M_PI * i / kNodes;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
  return {1, turn, kRadius * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle))};
}

Sim3 between(int from, int to) { return truth(from).inverse() * truth(to); }

// What tracking makes of the circle when each step grows by so much: every node as its predecessor has it.
PoseGraph drifted(double growth) {
  PoseGraph graph;
  for (int i = 0; i < kNodes; ++i) {
    if (i == 0) {
      graph.nodes.push_back({truth(0), true});
      continue;
    }
    PoseGraphEdge step;
    step.from = i - 1, step.to = i;
    step.measured = between(i - 1, i);
    step.measured.scale *= 1 + growth;
    step.turn_weight = step.shift_weight = step.scale_weight = 50;  // 2 % of a step
    graph.edges.push_back(step);
    graph.nodes.push_back({graph.nodes[i - 1].map_from_node * step.measured, false});
  }
  return graph;
}

PoseGraphEdge loop(int from, int to, const Sim3& measured) {
  PoseGraphEdge edge;
  edge.from = from, edge.to = to, edge.measured = measured;
  edge.turn_weight = edge.shift_weight = edge.scale_weight = 5000;
  return edge;
}

double worst_position(const PoseGraph& graph) {
  double worst = 0;
  for (int i = 0; i < kNodes; ++i) {
    worst = std::max(worst, (graph.nodes[i].map_from_node.translation - truth(i).translation).norm());
  }
  return worst;
}

TEST(PoseGraph, OneLoopUndoesTheDriftOfScale) {
  PoseGraph graph = drifted(0.01);
  EXPECT_GT(worst_position(graph), 0.3 * kRadius);
  graph.edges.push_back(loop(kNodes - 1, 0, between(kNodes - 1, 0)));
  const PoseGraphReport report = adjust_pose_graph(PoseGraphOptions(), &graph);
  EXPECT_TRUE(report.usable);
  EXPECT_LT(report.final_cost, report.initial_cost);
  EXPECT_LT(worst_position(graph), 0.001 * kRadius);
  for (int i = 0; i < kNodes; ++i) EXPECT_NEAR(graph.nodes[i].map_from_node.scale, 1, 0.001);
}

TEST(PoseGraph, TurnsAndShiftsDriftAndComeBack) {
  PoseGraph graph = drifted(0);
  const Sim3 bend(1, Eigen::Quaterniond(Eigen::AngleAxisd(0.005, Eigen::Vector3d(1, 2, -1).normalized())),
                  Eigen::Vector3d(0.005, -0.005, 0.01));
  for (int i = 1; i < kNodes; ++i) {
    graph.edges[i - 1].measured = graph.edges[i - 1].measured * bend;
    graph.nodes[i].map_from_node = graph.nodes[i - 1].map_from_node * graph.edges[i - 1].measured;
  }
  const double before = worst_position(graph);
  graph.edges.push_back(loop(kNodes - 1, 0, between(kNodes - 1, 0)));
  EXPECT_TRUE(adjust_pose_graph(PoseGraphOptions(), &graph).usable);
  EXPECT_LT(worst_position(graph), before / 4);
  const Sim3 closed = graph.nodes[kNodes - 1].map_from_node.inverse() * graph.nodes[0].map_from_node;
  EXPECT_LT((closed.translation - between(kNodes - 1, 0).translation).norm(), 0.001);
}

TEST(PoseGraph, FixedAndUnconnectedNodesStay) {
  PoseGraph graph = drifted(0.01);
  graph.nodes[0].fixed = false;
  graph.nodes[20].fixed = true;
  graph.nodes[20].map_from_node = truth(20);
  const Sim3 apart(3, Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 2, 3));
  graph.nodes.push_back({apart, false});
  graph.nodes.push_back({truth(1), false});
  graph.edges.push_back(loop(kNodes, kNodes + 1, Sim3()));
  const PoseGraph before = graph;
  EXPECT_TRUE(adjust_pose_graph(PoseGraphOptions(), &graph).usable);
  for (const int i : {20, kNodes, kNodes + 1}) {
    EXPECT_EQ(graph.nodes[i].map_from_node.translation, before.nodes[i].map_from_node.translation) << i;
    EXPECT_EQ(graph.nodes[i].map_from_node.scale, before.nodes[i].map_from_node.scale) << i;
  }
  EXPECT_LT((graph.nodes[21].map_from_node.translation - truth(21).translation).norm(), 0.05);
}

TEST(PoseGraph, WithNoneFixedTheFirstStays) {
  PoseGraph graph = drifted(0.01);
  graph.nodes[0].fixed = false;
  graph.edges.push_back(loop(kNodes - 1, 0, between(kNodes - 1, 0)));
  EXPECT_TRUE(adjust_pose_graph(PoseGraphOptions(), &graph).usable);
  EXPECT_EQ(graph.nodes[0].map_from_node.translation, truth(0).translation);
  EXPECT_LT(worst_position(graph), 0.001 * kRadius);
}

TEST(PoseGraph, TwoRunsGiveTheSameBytesAndACancelEndsOne) {
  PoseGraph a = drifted(0.01);
  a.edges.push_back(loop(kNodes - 1, 0, between(kNodes - 1, 0)));
  PoseGraph b = a;
  adjust_pose_graph(PoseGraphOptions(), &a);
  PoseGraphOptions options;
  int asked = 0;
  options.cancel = [&] { return ++asked == 2; };
  PoseGraph c = b;
  EXPECT_TRUE(adjust_pose_graph(options, &c).cancelled);
  EXPECT_EQ(asked, 2);
  adjust_pose_graph(PoseGraphOptions(), &b);
  for (int i = 0; i < kNodes; ++i) {
    EXPECT_EQ(a.nodes[i].map_from_node.translation, b.nodes[i].map_from_node.translation);
  }
}

TEST(PoseGraph, WhatIsNoGraphIsRefused) {
  const PoseGraph good = drifted(0);
  PoseGraph graph = good;
  graph.edges[3].to = kNodes;
  EXPECT_THROW(adjust_pose_graph(PoseGraphOptions(), &graph), std::invalid_argument);
  graph = good;
  graph.edges[3].scale_weight = 0;
  EXPECT_THROW(adjust_pose_graph(PoseGraphOptions(), &graph), std::invalid_argument);
  graph = good;
  graph.nodes[3].map_from_node.scale = -1;
  EXPECT_THROW(adjust_pose_graph(PoseGraphOptions(), &graph), std::invalid_argument);
  graph = good;
  graph.edges[3].measured.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(adjust_pose_graph(PoseGraphOptions(), &graph), std::invalid_argument);
  PoseGraphOptions options;
  options.max_iterations = 0;
  graph = good;
  EXPECT_THROW(adjust_pose_graph(options, &graph), std::invalid_argument);
  PoseGraph empty;
  EXPECT_FALSE(adjust_pose_graph(PoseGraphOptions(), &empty).usable);
}

}  // namespace
}  // namespace mono_pose_tracker
