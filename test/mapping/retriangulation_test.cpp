#include "mapping/retriangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "mapping/keyframe_landmarks.h"
#include "optimization/map_adjustment.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kHeadViews = 10, kHeadPoints = 400;
constexpr double kTurn = 3 * kDegree;  // rotation of the head between keyframes
constexpr double kHeadNoise = 0.1;     // px

double turn_of(int k) { return k * kTurn; }
// Back and forth: the first and the last view are from the same side.
double there_and_back(int k) { return std::min(k, kHeadViews - 1 - k) * 2 * kTurn; }

// The poses rotate `share` times as far as the head. Each landmark has two observations only, so that the map
// is consistent with its poses.
Map make_map(double share, double (*turn)(int) = turn_of) {
  Random random(3);
  const SyntheticScene scene = synthetic_head(kHeadPoints, random);
  const CameraModel camera = synthetic_camera();
  Map map;
  std::vector<LandmarkId> ids(kHeadPoints);
  for (int k = 0; k < kHeadViews; ++k) {
    for (int i = 0; i < kHeadPoints && k % 2 == 0; ++i) ids[i] = map.add_landmark(scene.x_in_map[i]);
    add_view(scene, camera, before_turned_head(turn(k)), kHeadNoise, k, ids, random, &map);
    map.set_pose(k, before_turned_head(share * turn(k)));
  }
  return map;
}

double total_turn(const Map& map) {
  return map.keyframe(0)->camera_from_map.rotation.angularDistance(
      map.keyframe(kHeadViews - 1)->camera_from_map.rotation);
}

bool nothing_is_excluded(KeyframeId, int) { return false; }

constexpr double kTruth = (kHeadViews - 1) * kTurn;

// Retriangulates from the view graph of all pairs.
void retriangulate(const IsExcluded& is_excluded, int min_landmarks, Map* map) {
  ViewGraph graph(view_graph_options(MapperOptions()));
  std::vector<ViewGraph::Pair> pairs;
  for (const auto& [id, keyframe] : map->keyframes()) {
    const int node = graph.add(keyframe.frame_index, keyframe.image);
    for (int other = 0; other < node; ++other) pairs.emplace_back(other, node);
  }
  graph.connect(pairs);
  replace_landmarks(graph_tracks(*map, edge_consistency(*map, graph, {}), graph, is_excluded), min_landmarks,
                    map);
}

void adjust(Map* map) {
  adjust_map(with_wide_loss(BundleOptions()), map);
  adjust_map(BundleOptions(), map);
}

TEST(Retriangulation, SetsAMapRightThatAgreesWithItself) {
  for (const double share : {0.9, 1.0, 1.1}) {
    Map map = make_map(share);
    retriangulate(nothing_is_excluded, 15, &map);
    adjust(&map);
    EXPECT_NEAR(total_turn(map), kTruth, 0.5 * kDegree) << share;
    EXPECT_GT(map.landmarks().size(), 0.8 * kHeadPoints) << share;
    map.check();
  }
}

TEST(Retriangulation, OfARightMapMakesLandmarksOfAllViews) {
  Map map = make_map(1);
  retriangulate(nothing_is_excluded, 15, &map);
  double observations = 0;
  for (const auto& entry : map.landmarks())
    observations += static_cast<double>(entry.second.observations.size());
  EXPECT_GT(observations / static_cast<double>(map.landmarks().size()), 0.8 * kHeadViews);
}

TEST(Retriangulation, ATrackThatEndsWhereItBeganIsTriangulatedFromItsMiddle) {
  Map map = make_map(1, there_and_back);
  retriangulate(nothing_is_excluded, 15, &map);
  EXPECT_GT(map.landmarks().size(), 0.8 * kHeadPoints);
  double observations = 0;
  for (const auto& entry : map.landmarks())
    observations += static_cast<double>(entry.second.observations.size());
  EXPECT_GT(observations / static_cast<double>(map.landmarks().size()), 0.8 * kHeadViews);
}

TEST(Retriangulation, KeepsIds) {
  Map map = make_map(1);
  const Map before = map;
  retriangulate(nothing_is_excluded, 15, &map);
  std::size_t kept = 0;
  for (const auto& [id, landmark] : map.landmarks()) {
    const Landmark* known = before.landmark(id);
    if (!known) continue;
    ++kept;
    EXPECT_NEAR((known->x_in_map - landmark.x_in_map).norm(), 0, 0.05);
  }
  EXPECT_GT(kept, 0.9 * map.landmarks().size());
}

TEST(Retriangulation, KeepsLandmarksOfKeyframesThatTracksWouldNotConstrain) {
  Map map = make_map(1);
  const std::size_t of_fifth = landmarks_of(*map.keyframe(5)).size();
  retriangulate([](KeyframeId keyframe, int) { return keyframe == 5; }, 15, &map);
  EXPECT_EQ(landmarks_of(*map.keyframe(5)).size(), of_fifth);
  map.check();
}

TEST(Retriangulation, ExcludesMaskedFeatures) {
  Map map = make_map(1);
  for (const LandmarkId id : map.landmark_ids()) {
    const std::vector<Observation> observations = map.landmark(id)->observations;
    for (const Observation& o : observations) {
      if (o.feature % 4 == 0) map.remove_observation(id, o.keyframe);
    }
  }
  retriangulate([](KeyframeId, int feature) { return feature % 4 == 0; }, 15, &map);
  ASSERT_GT(map.landmarks().size(), 0.5 * kHeadPoints);
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); f += 4)
      EXPECT_EQ(keyframe.landmark_of_feature[f], kNoLandmark);
  }
}

TEST(Retriangulation, OfAnEmptyMapChangesNothing) {
  Map map;
  retriangulate(nothing_is_excluded, 15, &map);
  EXPECT_TRUE(map.landmarks().empty());
}

}  // namespace
}  // namespace mono_pose_tracker
