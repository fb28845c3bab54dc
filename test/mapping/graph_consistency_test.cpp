#include "mapping/graph_consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "common/rotation.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kKeyframes = 16, kPoints = 200;

// A camera moves along a box of points. Keyframes of a segment are displaced, together with their own copies
// of the landmarks.
struct DisplacedSegment {
  int begin = 0, end = 0;
  Eigen::Vector3d rotation{0.3, 0.2, 0.2};  // rad, about an axis: not along the epipolar lines of the walk
};

Rigid3 displacement(const DisplacedSegment& segment) {
  if (segment.rotation.norm() == 0) return Rigid3(Eigen::Quaterniond::Identity(), {0.5, 0.3, 0});
  return Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(segment.rotation.norm(), segment.rotation.normalized())),
                {0.5, 0, 0});
}

Map map_with(const DisplacedSegment& segment) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kPoints, random);
  const Rigid3 displaced_from_map = displacement(segment);
  Map map;
  std::vector<LandmarkId> here, there;
  for (const Eigen::Vector3d& x : scene.x_in_map) {
    here.push_back(map.add_landmark(x));
    there.push_back(map.add_landmark(displaced_from_map * x));
  }
  for (int k = 0; k < kKeyframes; ++k) {
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree);
    const bool is_displaced = k >= segment.begin && k < segment.end;
    add_view(scene, camera, camera_from_map, 0.5, k, is_displaced ? there : here, random, &map);
    if (is_displaced) map.set_pose(k, camera_from_map * displaced_from_map.inverse());
  }
  map.check();
  return map;
}

ViewGraph graph_of(const Map& map) {
  ViewGraphOptions options;
  options.ransac = TrackerOptions().ransac(synthetic_camera().focal());
  ViewGraph graph(options);
  std::vector<ViewGraph::Pair> pairs;
  for (const auto& entry : map.keyframes()) {
    const int node = graph.add(entry.second.frame_index, entry.second.image);
    for (const int before : {1, 2, 4}) {
      if (node >= before) pairs.emplace_back(node - before, node);
    }
  }
  graph.connect(pairs);
  return graph;
}

std::optional<InconsistentSegment> segment_of(const Map& map, const ViewGraph& graph) {
  const std::vector<InconsistentSegment> segments =
      inconsistent_segments(map, edge_consistency(map, graph, {}), {});
  EXPECT_LE(segments.size(), 1u);
  return segments.empty() ? std::nullopt : std::make_optional(segments.front());
}

TEST(ViewGraph, EdgesOfAWalkAreCalibratedAndExplainedByTheTruePoses) {
  const Map map = map_with({});
  const ViewGraph graph = graph_of(map);
  ASSERT_FALSE(graph.edges().empty());
  for (const auto& [pair, geometry] : graph.edges()) {
    // Neighbours have too little parallax for a translation.
    if (pair.second - pair.first == 4) {
      EXPECT_EQ(geometry.type, TwoViewType::kCalibrated);
    }
    const Rigid3 truth =
        map.keyframe(pair.second)->camera_from_map * map.keyframe(pair.first)->camera_from_map.inverse();
    const std::vector<char> explained = graph.explained_by(pair, truth);
    EXPECT_GT(geometry.inliers(), 50);
    EXPECT_GT(std::count(explained.begin(), explained.end(), 1), 0.95 * geometry.inliers());
  }
}

TEST(ViewGraph, AnEdgeIsComputedOnce) {
  const Map map = map_with({});
  ViewGraph graph = graph_of(map);
  const TwoViewGeometry* before = graph.edge(0, 1);
  graph.connect({{1, 0}, {0, 0}});
  EXPECT_EQ(graph.edge(0, 1), before);
  EXPECT_EQ(graph.edge(0, 0), nullptr);
}

TEST(ViewGraph, AnEdgeThatCouldNotBeComputedIsNone) {
  const Map map = map_with({});
  ViewGraphOptions options;
  options.ransac = TrackerOptions().ransac(synthetic_camera().focal());
  options.ransac.min_iterations = -1;
  ViewGraph graph(options);
  for (const KeyframeId id : {0, 1}) graph.add(id, map.keyframe(id)->image);
  EXPECT_THROW(graph.connect({{0, 1}}), std::invalid_argument);
  EXPECT_EQ(graph.edge(0, 1), nullptr);
}

TEST(ViewGraph, FeaturesThatAreExtractedAgainAreTheSameNode) {
  const Map map = map_with({});
  ViewGraph graph = graph_of(map);
  const std::size_t nodes = graph.nodes().size();
  const Keyframe& keyframe = *map.keyframe(3);
  const auto again = std::make_shared<const ImageFeatures>(*keyframe.image);
  EXPECT_EQ(graph.add(3, again), graph.node_of(3, keyframe.image));
  EXPECT_EQ(graph.nodes().size(), nodes);
  // Other features of the frame, such as within another mask, and another frame.
  EXPECT_EQ(graph.node_of(3, map.keyframe(4)->image), -1);
  EXPECT_EQ(graph.node_of(99, again), -1);
}

TEST(ViewGraph, ACameraThatTurnsOnTheSpotIsPanoramic) {
  Random random(3);
  const SyntheticScene scene = box_scene(kPoints, random);
  ViewGraphOptions options;
  options.ransac = TrackerOptions().ransac(synthetic_camera().focal());
  ViewGraph graph(options);
  for (int k = 0; k < 2; ++k) {
    graph.add(
        k, synthetic_frame(scene, synthetic_camera(), camera_at({0, 0, 0}, 4 * k * kDegree), 0.5, k, random)
               .image);
  }
  graph.connect({{0, 1}});
  EXPECT_EQ(graph.edge(0, 1)->type, TwoViewType::kPanoramic);
}

// A walk along a box, in which the frames `other` show a quarter of it and 200 points that no other image
// shows. Frames 6, 7 and 9 have no pose.
std::set<std::int64_t> unsupported_in_a_walk(const std::set<int>& other) {
  Random random(5);
  const SyntheticScene box = box_scene(kPoints, random), unknown = box_scene(kPoints, random);
  const std::vector<Eigen::Vector3d>& near = box.x_in_map;
  SyntheticScene both = unknown;
  both.x_in_map.insert(both.x_in_map.end(), near.begin(), near.begin() + kPoints / 4);
  both.descriptors.push_back(box.descriptors.rowRange(0, kPoints / 4));
  ViewGraphOptions options;
  options.ransac = TrackerOptions().ransac(synthetic_camera().focal());
  ViewGraph graph(options);
  std::map<std::int64_t, Rigid3> poses;
  std::vector<ViewGraph::Pair> pairs;
  for (int k = 0; k < kKeyframes; ++k) {
    const Rigid3 pose = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree);
    const SyntheticScene& scene = other.count(k) ? both : box;
    graph.add(k, synthetic_frame(scene, synthetic_camera(), pose, 0.5, k, random).image);
    if (k != 6 && k != 7 && k != 9) poses[k] = pose;
    for (const int before : {1, 2, 4}) {
      if (k >= before) pairs.emplace_back(k - before, k);
    }
  }
  graph.connect(pairs);
  return unsupported_images(graph, poses, {});
}

// As one image of a symmetric object that repeated structure has placed at the other side.
TEST(UnsupportedImages, AnImageWhoseFeaturesAreInImagesWithoutAPoseIsOne) {
  EXPECT_EQ(unsupported_in_a_walk({6, 7, 8, 9}), (std::set<std::int64_t>{8}));
}

TEST(UnsupportedImages, AnImageThatTheMapExplainsIsNone) {
  EXPECT_TRUE(unsupported_in_a_walk({}).empty()) << "its neighbours in time have no pose";
  EXPECT_TRUE(unsupported_in_a_walk({8}).empty()) << "no image matches what it alone shows";
}

TEST(GraphConsistency, ARightMapHasNoInconsistentEdge) {
  const Map map = map_with({});
  const ViewGraph graph = graph_of(map);
  for (const EdgeConsistency& edge : edge_consistency(map, graph, {})) {
    EXPECT_GT(edge.explained, 0.9 * edge.matches);
    EXPECT_GT(edge.supported, 0.9 * edge.matches);
  }
  EXPECT_FALSE(segment_of(map, graph));
}

TEST(GraphConsistency, AKeyframeDisplacedAlongTheEpipolarLinesIsContradicted) {
  Map map = map_with({});
  const ViewGraph graph = graph_of(map);
  EXPECT_FALSE(segment_of(map, graph));
  constexpr KeyframeId kDisplaced = 7;
  const Keyframe keyframe = *map.keyframe(kDisplaced);
  for (const LandmarkId id : keyframe.landmark_of_feature) {
    if (id != kNoLandmark) map.remove_observation(id, kDisplaced);
  }
  // Along the walk: the poses explain all matches with the neighbours still.
  map.set_pose(kDisplaced,
               keyframe.camera_from_map * Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0)));
  const auto segment = segment_of(map, graph);
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->keyframes, (std::vector<KeyframeId>{kDisplaced}));
  EXPECT_TRUE(other_place(map, graph, *segment, {}).is_better({}));
}

TEST(GraphConsistency, TheOtherLandmarksConfirmARightSegment) {
  const Map map = map_with({});
  const ViewGraph graph = graph_of(map);
  InconsistentSegment segment;
  segment.keyframes = {6, 7, 8};
  const auto is_inside = [](KeyframeId id) { return id >= 6 && id <= 8; };
  for (const EdgeConsistency& edge : edge_consistency(map, graph, {})) {
    if (is_inside(edge.first) != is_inside(edge.second)) segment.cut.push_back(edge);
  }
  const SegmentPlacement place = other_place(map, graph, segment, {});
  EXPECT_TRUE(place.confirms_map({}));
  EXPECT_GT(place.matches, 100);
}

TEST(GraphConsistency, ADisplacedSegmentIsFoundFromEndToEnd) {
  const Map map = map_with({6, 9});
  const auto segment = segment_of(map, graph_of(map));
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->keyframes, (std::vector<KeyframeId>{6, 7, 8}));
  EXPECT_LT(2 * segment->supported, segment->matches);
}

// A turntable that jumps: image 5, the first after the jump, is wrong. Its neighbours are right, and match
// repeated structure on the other side as well: together they have more unsupported matches over their cut.
TEST(GraphConsistency, AWrongImageIsFoundRatherThanItsNeighboursThatSeeRepeatedStructure) {
  const Map map = map_with({});
  std::vector<EdgeConsistency> edges;
  const auto add = [&](KeyframeId first, KeyframeId second, int matches, int supported) {
    EdgeConsistency edge;
    edge.first = first;
    edge.second = second;
    edge.matches = matches;
    edge.explained = edge.supported = supported;
    edges.push_back(edge);
  };
  for (const KeyframeId k : {0, 1, 2, 3, 6, 7, 9, 10, 11, 12, 13, 14}) add(k, k + 1, 300, 300);
  add(8, 9, 350, 350);
  add(7, 9, 160, 160);
  add(3, 9, 200, 200);
  add(4, 9, 300, 300);
  add(4, 5, 60, 60);
  add(5, 6, 250, 0);
  add(5, 7, 175, 0);
  add(5, 8, 100, 0);
  for (const KeyframeId k : {6, 7, 8}) {
    for (const KeyframeId opposite : {0, 1}) add(opposite, k, 30, 0);
  }
  const std::vector<InconsistentSegment> segments = inconsistent_segments(map, edges, {});
  ASSERT_FALSE(segments.empty());
  EXPECT_EQ(segments.front().keyframes, (std::vector<KeyframeId>{5}));
  EXPECT_EQ(segments.front().matches, 585);
  EXPECT_EQ(segments.front().supported, 60);
}

TEST(GraphConsistency, TheSecondHalfIsMovedWhereTheFirstHasIt) {
  Map map = map_with({8, 16});
  const ViewGraph graph = graph_of(map);
  const auto segment = segment_of(map, graph);
  ASSERT_TRUE(segment);
  const SegmentPlacement place = other_place(map, graph, *segment, {});
  EXPECT_TRUE(place.is_better({}));
  EXPECT_FALSE(place.confirms_map({}));
  move_segment(*segment, place, &map);
  map.check();
  EXPECT_FALSE(segment_of(map, graph));
  // The true path up to the noise of the landmarks.
  for (int k = 1; k < kKeyframes; ++k) {
    const Rigid3 step = map.keyframe(k)->camera_from_map * map.keyframe(0)->camera_from_map.inverse();
    const Rigid3 truth = camera_at({0.06 * k, 0, 0}, -0.5 * k * kDegree) * camera_at({0, 0, 0}, 0).inverse();
    EXPECT_LT(step.rotation.angularDistance(truth.rotation), 1 * kDegree) << k;
  }
}

}  // namespace
}  // namespace mono_pose_tracker
