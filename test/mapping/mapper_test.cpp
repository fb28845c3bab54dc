#include "mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "known_scene.h"
#include "support/mapper_tests.h"

namespace mono_pose_tracker {
namespace {

class MapperTest : public testing::Test {
 protected:
  MapperOptions options() const { return unhurried_options().mapper(scene_.camera.focal()); }

  // Candidate of a view with a known pose, relative to the map's newest keyframe, with its observations of
  // the landmarks.
  KeyframeCandidate candidate(const Map& map, const Frame& frame, const Rigid3& true_pose) const {
    const Keyframe& newest = map.keyframes().rbegin()->second;
    const Rigid3 true_newest = KnownScene::pose(static_cast<int>(newest.frame_index));
    KeyframeCandidate result{1, frame, newest.id, true_pose * true_newest.inverse(), {}};
    result.camera_from_reference.translation *= unit(map);
    for (const auto& [id, landmark] : map.landmarks()) {
      const int point = scene_.point_of_landmark(map, landmark);
      const int feature = point < 0 ? -1 : scene_.feature_of(frame.index, point);
      if (feature >= 0) result.observations.push_back({feature, id});
    }
    std::sort(result.observations.begin(), result.observations.end(),
              [](const FrameObservation& a, const FrameObservation& b) { return a.feature < b.feature; });
    return result;
  }

  void insert(Mapper* mapper, int view) {
    const Frame frame = scene_.frame(view);
    mapper->insert(candidate(mapper->map(), frame, KnownScene::pose(view)));
  }

  // Map units per unit of the scene, from the first two keyframes.
  static double unit(const Map& map) {
    const auto center = [&](KeyframeId id) {
      Rigid3 camera_from_map;
      EXPECT_TRUE(map.camera_from_map(id, &camera_from_map));
      return Eigen::Vector3d(camera_from_map.inverse().translation);
    };
    return (center(1) - center(0)).norm() /
           (KnownScene::pose(1).inverse().translation - KnownScene::pose(0).inverse().translation).norm();
  }

  void expect_no_wrong_observation(const Map& map) const {
    int wrong = 0;
    for (const auto& entry : map.landmarks()) wrong += scene_.point_of_landmark(map, entry.second) < 0;
    EXPECT_EQ(wrong, 0);
  }

  KnownScene scene_{300};
};

TEST_F(MapperTest, WithoutAScaleTheFirstViewsMedianDepthIsOne) {
  Mapper mapper(options());
  mapper.initialize(scene_.initial_map(1), 3);
  std::vector<double> depths;
  for (const auto& entry : mapper.map().landmarks()) depths.push_back(entry.second.x_in_map.z());
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  EXPECT_NEAR(depths[depths.size() / 2], 1, 0.05) << "the adjustment may move it a little";
  EXPECT_EQ(mapper.tracking_map()->epoch, 3u);
  EXPECT_EQ(mapper.map().scale_source(), ScaleSource::kMapUnits);
}

double baseline_of(const Map& map) {
  return (map.keyframe(1)->center_in_map() - map.keyframe(0)->center_in_map()).norm();
}

TEST_F(MapperTest, AKnownBaselineSetsTheScale) {
  MapperOptions metres = options();
  metres.scale.known_baseline = 0.4;
  Mapper mapper(metres);
  const InitialMap initial = scene_.initial_map(1);
  mapper.initialize(initial, 0);
  EXPECT_NEAR(baseline_of(mapper.map()), 0.4, 1e-9);
  EXPECT_EQ(mapper.map().scale_source(), ScaleSource::kKnownBaseline);
  // The uncertainty is reported in metres as well.
  Mapper in_units(options());
  in_units.initialize(initial, 0);
  const double unit_m =
      0.4 /
      (in_units.map().keyframe(1)->center_in_map() - in_units.map().keyframe(0)->center_in_map()).norm();
  const auto variance = [](const Mapper& m) {
    const Eigen::Matrix<double, 6, 6> covariance = m.tracking_map()->covariances.find(1)->second;
    return covariance.topLeftCorner<3, 3>().trace();
  };
  EXPECT_NEAR(variance(mapper) / variance(in_units), unit_m * unit_m, 1e-6 * unit_m * unit_m);
}

// The first two views determine the unit to some per cent; later views are more accurate.
TEST_F(MapperTest, AKnownBaselineIsKeptWhateverIsLearntLater) {
  MapperOptions metres = options();
  metres.scale.known_baseline = 0.4;
  Mapper mapper(metres);
  mapper.initialize(scene_.initial_map(1), 0);
  for (int view = 2; view < 6; ++view) insert(&mapper, view);
  EXPECT_NEAR(baseline_of(mapper.map()), 0.4, 0.01 * 0.4) << "asked at six keyframes";
  mapper.finish();
  EXPECT_NEAR(baseline_of(mapper.map()), 0.4, 1e-9);
  EXPECT_EQ(mapper.map().scale_source(), ScaleSource::kKnownBaseline);
}

// A square of side 1 in front of the first camera, its corners with 0.3 px noise.
std::vector<Eigen::Vector3d> seen_marker(const KnownScene& scene, int view, Random* random) {
  std::vector<Eigen::Vector3d> bearings;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    Eigen::Vector2d pixel;
    EXPECT_TRUE(scene.camera.project(KnownScene::pose(view) * Eigen::Vector3d(0.5 * x, 0.5 * y, 7), &pixel));
    bearings.push_back(
        scene.camera.bearing(pixel + 0.3 * Eigen::Vector2d(random->normal(), random->normal())));
  }
  return bearings;
}

// The first two views observe it with 1.2 degrees of parallax, which leaves its depth uncertain by some per
// cent.
TEST_F(MapperTest, AMarkerSetsTheScaleAsSoonAsItIsSeenFromFarEnoughApart) {
  MapperOptions metres = options();
  metres.scale.marker_size = 1;
  for (int seed = 0; seed < 5; ++seed) {
    Random random(seed);
    Mapper mapper(metres);
    InitialMap initial = scene_.initial_map(1);
    for (int view = 0; view < 2; ++view)
      initial.views[view].frame.marker = seen_marker(scene_, view, &random);
    mapper.initialize(initial, 0);
    EXPECT_EQ(mapper.map().scale_source(), ScaleSource::kMapUnits);
    for (int view = 2; view < 6; ++view) {
      Frame frame = scene_.frame(view);
      frame.marker = seen_marker(scene_, view, &random);
      KeyframeCandidate next = candidate(mapper.map(), frame, KnownScene::pose(view));
      next.corrections = mapper.map().scale_source() == ScaleSource::kMarker ? 1 : 0;
      mapper.insert(next);
    }
    EXPECT_EQ(mapper.map().scale_source(), ScaleSource::kMarker);
    EXPECT_NEAR(unit(mapper.map()), 1, 0.06) << seed << ": as far as a square may be none";
  }
}

// Only every third point is known at first: the others are matched along epipolar lines, and tracks grow.
TEST_F(MapperTest, KeyframesBringNewLandmarksAndLongerTracks) {
  Mapper mapper(options());
  const InitialMap initial = scene_.initial_map(3);
  mapper.initialize(initial, 0);
  EXPECT_GT(mapper.map().landmarks().size(), 2 * initial.points.size()) << "between the first two already";
  for (int view = 2; view < 6; ++view) insert(&mapper, view);
  const Map& map = mapper.map();
  map.check();
  expect_no_wrong_observation(map);
  EXPECT_GT(map.landmarks().size(), 200u);
  std::size_t observations = 0;
  for (const auto& entry : map.landmarks()) observations += entry.second.observations.size();
  EXPECT_GT(static_cast<double>(observations) / map.landmarks().size(), 0.6 * map.keyframes().size());
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Rigid3 truth = KnownScene::pose(static_cast<int>(keyframe.frame_index));
    // A rotation of 5 mrad and a lateral displacement of 0.02 are nearly equivalent at the points' distance
    // of 4.
    EXPECT_LT(keyframe.camera_from_map.rotation.angularDistance(truth.rotation), 5e-3) << id;
    EXPECT_LT((keyframe.center_in_map() / unit(map) - truth.inverse().translation).norm(), 0.02) << id;
  }
}

TEST_F(MapperTest, WrongObservationsGo) {
  Mapper mapper(options());
  mapper.initialize(scene_.initial_map(1), 0);
  insert(&mapper, 2);
  const Frame frame = scene_.frame(3);
  KeyframeCandidate wrong = candidate(mapper.map(), frame, KnownScene::pose(3));
  // Every tenth pair of observations is exchanged.
  for (std::size_t i = 0; i + 1 < wrong.observations.size(); i += 10) {
    std::swap(wrong.observations[i].landmark, wrong.observations[i + 1].landmark);
  }
  mapper.insert(wrong);
  mapper.map().check();
  int of_another_point = 0;
  for (const auto& entry : mapper.map().landmarks()) {
    of_another_point += scene_.point_of_landmark(mapper.map(), entry.second) < 0;
  }
  EXPECT_LE(of_another_point, 2) << "of two points whose pixels are as near as the threshold";
}

TEST_F(MapperTest, AKeyframeOfWhichNothingIsNewGoesAndItsPlaceIsKept) {
  Mapper mapper(options());
  mapper.initialize(scene_.initial_map(1), 0);
  for (int view = 2; view < 5; ++view) insert(&mapper, view);
  for (int i = 0; i < 5; ++i) {  // at rest
    const Frame frame = scene_.frame(100 + i, KnownScene::pose(4));
    KeyframeCandidate candidate = this->candidate(mapper.map(), frame, KnownScene::pose(4));
    const Keyframe& newest = mapper.map().keyframes().rbegin()->second;
    if (newest.frame_index >= 100) candidate.camera_from_reference = Rigid3();
    mapper.insert(candidate);
  }
  const Map& map = mapper.map();
  map.check();
  EXPECT_LT(map.keyframes().size(), 8u);
  EXPECT_EQ(map.keyframes().size() + map.removed_keyframes().size(), 10u);
  EXPECT_EQ(map.keyframes().begin()->first, 0) << "the map's frame";
  for (const auto& entry : map.removed_keyframes()) {
    Rigid3 camera_from_map;
    ASSERT_TRUE(map.camera_from_map(entry.first, &camera_from_map));
    const int view = std::min<int>(4, static_cast<int>(entry.second.frame_index));
    EXPECT_LT(
        (camera_from_map.inverse().translation / unit(map) - KnownScene::pose(view).inverse().translation)
            .norm(),
        0.03);
  }
}

TEST_F(MapperTest, ACappedMapKeepsItsFrameItsNewestAndItsAccuracy) {
  constexpr int kViews = 18, kMost = 10;
  MapperOptions capped = options();
  capped.mapping.max_keyframes = kMost;
  capped.mapping.redundant_overlap = 1.01;  // keyframes are removed only by the limit
  Mapper mapper(capped);
  mapper.initialize(scene_.initial_map(1), 0);
  for (int view = 2; view < kViews; ++view) {
    insert(&mapper, view);
    mapper.map().check();
    EXPECT_LE(mapper.map().keyframes().size(), static_cast<std::size_t>(kMost));
    EXPECT_EQ(mapper.map().keyframes().rbegin()->second.frame_index, view) << "the newest never goes";
  }
  const Map& map = mapper.map();
  EXPECT_EQ(map.keyframes().size(), static_cast<std::size_t>(kMost));
  EXPECT_EQ(map.keyframes().size() + map.removed_keyframes().size(), static_cast<std::size_t>(kViews));
  EXPECT_TRUE(map.keyframe(0) && map.keyframe(1)) << "the map's frame and scale";
  for (int id = 0; id < kViews; ++id) {
    Rigid3 camera_from_map;
    ASSERT_TRUE(map.camera_from_map(id, &camera_from_map)) << "frames may ride on it";
    const Rigid3 truth = KnownScene::pose(id);
    EXPECT_LT(camera_from_map.rotation.angularDistance(truth.rotation), 0.01) << id;
    EXPECT_LT((camera_from_map.inverse().translation / unit(map) - truth.inverse().translation).norm(), 0.05)
        << id;
  }
  for (const auto& entry : map.landmarks()) EXPECT_GE(entry.second.observations.size(), 2u);
  const TrackingMapPtr view = mapper.tracking_map();
  const std::vector<KeyframeId> places = view->places->find(scene_.frame(kViews).image->set, kViews);
  EXPECT_FALSE(places.empty());
  for (const KeyframeId place : places) EXPECT_TRUE(map.keyframe(place)) << place << " is gone";
}

// Four views of one place, then one of another: views whose points the others observe are redundant.
TEST_F(MapperTest, TheKeyframeThatIsMissedLeastGoesFirst) {
  MapperOptions capped = options();
  capped.mapping.max_keyframes = 10;
  capped.mapping.redundant_overlap = 1.01;
  capped.mapping.window_keyframes = 2;  // so that few are protected as neighbours of the newest
  Mapper mapper(capped);
  mapper.initialize(scene_.initial_map(1), 0);
  for (int view = 2; view < 10; ++view) insert(&mapper, view);
  const Map before = mapper.map();
  ASSERT_EQ(before.keyframes().size(), 10u);
  insert(&mapper, 10);
  const Map& after = mapper.map();
  ASSERT_EQ(after.removed_keyframes().size(), 1u);
  const auto needed = [&](KeyframeId id) {  // landmarks that fewer than three others see
    int count = 0, all = 0;
    for (const LandmarkId l : before.keyframe(id)->landmark_of_feature) {
      if (l == kNoLandmark) continue;
      ++all;
      count += before.landmark(l)->observations.size() < 4;
    }
    return static_cast<double>(count) / all;
  };
  const KeyframeId gone = after.removed_keyframes().begin()->first;
  int missed_less = 0;
  for (KeyframeId id = 2; id < 10; ++id) missed_less += needed(id) < needed(gone) - 0.1;
  EXPECT_LE(missed_less, 2) << "but for those that are spared";
}

TEST_F(MapperTest, ACandidateWhoseReferenceIsUnknownIsPassedOver) {
  Mapper mapper(options());
  mapper.initialize(scene_.initial_map(1), 0);
  const TrackingMapPtr before = mapper.tracking_map();
  const Frame frame = scene_.frame(2);
  KeyframeCandidate candidate = this->candidate(mapper.map(), frame, KnownScene::pose(2));
  candidate.reference = 77;
  mapper.insert(candidate);
  EXPECT_EQ(mapper.map().keyframes().size(), 2u);
  EXPECT_EQ(mapper.tracking_map(), before);
}

TEST_F(MapperTest, KeyframesThatAreWrongGoWithWhatTheyAloneSaw) {
  MapperOptions all = options();
  all.mapping.redundant_overlap = 2;  // no keyframe goes by itself
  Mapper mapper(all);
  mapper.initialize(scene_.initial_map(3), 0);
  for (int view = 2; view < 6; ++view) insert(&mapper, view);
  Atlas atlas;
  atlas.present().map = mapper.map();
  atlas.remove_keyframes({0, 3, 4, 99}, all);
  const Map& map = atlas.map();
  map.check();
  std::vector<KeyframeId> left;
  for (const auto& entry : map.keyframes()) left.push_back(entry.first);
  EXPECT_EQ(left, std::vector<KeyframeId>({1, 2, 5}));
  for (const auto& entry : map.landmarks()) EXPECT_GE(entry.second.observations.size(), 2u);
}

TEST_F(MapperTest, TheFinishedMapKeepsWhatThreeViewsSee) {
  MapperOptions all = options();
  all.mapping.redundant_overlap = 2;  // no keyframe goes
  Mapper mapper(all);
  mapper.initialize(scene_.initial_map(3), 0);
  for (int view = 2; view < 6; ++view) insert(&mapper, view);
  mapper.finish();
  const Map& map = mapper.map();
  map.check();
  expect_no_wrong_observation(map);
  ASSERT_EQ(map.keyframes().size(), 6u);
  EXPECT_GT(map.landmarks().size(), 200u);
  for (const auto& entry : map.landmarks()) EXPECT_GE(entry.second.observations.size(), 3u);
}

}  // namespace
}  // namespace mono_pose_tracker
