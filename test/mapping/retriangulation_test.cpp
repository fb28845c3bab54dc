#include "mapping/retriangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/angles.h"
#include "support/add_view.h"
#include "support/synthetic_head.h"

namespace mono_pose_tracker {
namespace {

constexpr int kHeadViews = 10, kHeadPoints = 400;
constexpr double kTurn = 3 * kDegree;  // the head turns, from one keyframe to the next
constexpr double kHeadNoise = 0.1;     // px

// The poses say that it turns `share` times as far as it does. Each landmark is seen by two keyframes only:
// the map has nothing that would speak against its poses.
Map make_map(double share) {
  Random random(3);
  const SyntheticScene scene = synthetic_head(kHeadPoints, random);
  const CameraModel camera = synthetic_camera();
  Map map;
  std::vector<LandmarkId> ids(kHeadPoints);
  for (int k = 0; k < kHeadViews; ++k) {
    for (int i = 0; i < kHeadPoints && k % 2 == 0; ++i) ids[i] = map.add_landmark(scene.x_in_map[i]);
    add_view(scene, camera, before_turned_head(k * kTurn), kHeadNoise, k, ids, random, &map);
    map.set_pose(k, before_turned_head(share * k * kTurn));
  }
  return map;
}

double total_turn(const Map& map) {
  return map.keyframe(0)->camera_from_map.rotation.angularDistance(
      map.keyframe(kHeadViews - 1)->camera_from_map.rotation);
}

bool nothing_is_masked(KeyframeId, int) { return false; }

// Each keyframe with the three before it.
bool retriangulate_by_its_graph(int min_landmarks, const IsLeftOut& is_masked, Map* map) {
  ViewGraphOptions options;
  options.ransac.threshold = 1e-3;
  ViewGraph graph(options);
  std::vector<int> nodes;
  std::vector<ViewGraph::Pair> pairs;
  for (const auto& [id, keyframe] : map->keyframes()) {
    nodes.push_back(graph.add(keyframe.frame_index, keyframe.image));
    const int last = static_cast<int>(nodes.size()) - 1;
    for (int before = std::max(0, last - 3); before < last; ++before)
      pairs.emplace_back(nodes[before], nodes[last]);
  }
  graph.connect(pairs);
  return retriangulate(BundleOptions(), graph, edge_consistency(*map, graph, GraphConsistencyOptions()),
                       is_masked, min_landmarks, map);
}

constexpr double kTruth = (kHeadViews - 1) * kTurn;

TEST(Retriangulation, CorrectsAMapThatAgreesWithItself) {
  for (const double share : {0.75, 0.9, 1.15}) {
    Map map = make_map(share);
    ASSERT_GT(std::abs(total_turn(map) - kTruth), 2 * kDegree);
    EXPECT_TRUE(retriangulate_by_its_graph(15, nothing_is_masked, &map)) << share;
    EXPECT_NEAR(total_turn(map), kTruth, 0.5 * kDegree) << share;
    EXPECT_GT(map.landmarks().size(), 0.8 * kHeadPoints) << share;
    map.check();
  }
}

TEST(Retriangulation, KeepsARightMapRight) {
  Map map = make_map(1);
  EXPECT_TRUE(retriangulate_by_its_graph(15, nothing_is_masked, &map));
  EXPECT_NEAR(total_turn(map), kTruth, 0.1 * kDegree);
  EXPECT_GT(map.landmarks().size(), 0.8 * kHeadPoints);
}

TEST(Retriangulation, MustConstrainEveryKeyframe) {
  Map map = make_map(0.75);
  const double before = total_turn(map);
  EXPECT_FALSE(retriangulate_by_its_graph(kHeadPoints + 1, nothing_is_masked, &map));
  const auto is_of_fifth = [](KeyframeId keyframe, int) { return keyframe == 5; };
  EXPECT_FALSE(retriangulate_by_its_graph(15, is_of_fifth, &map));
  EXPECT_EQ(total_turn(map), before);
}

TEST(Retriangulation, UsesNoMaskedFeature) {
  Map map = make_map(0.75);
  const auto is_left_out = [](KeyframeId, int feature) { return feature % 4 == 0; };
  EXPECT_TRUE(retriangulate_by_its_graph(15, is_left_out, &map));
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); f += 4) {
      EXPECT_EQ(keyframe.landmark_of_feature[f], kNoLandmark);
    }
  }
}

TEST(Retriangulation, DoesNothingToAnEmptyMap) {
  Map map;
  EXPECT_FALSE(retriangulate_by_its_graph(15, nothing_is_masked, &map));
}

}  // namespace
}  // namespace mono_pose_tracker
