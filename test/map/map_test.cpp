#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/map/map_views.h"

namespace mono_pose_tracker {
namespace {

ImageFeaturesPtr image_of(int features) {
  auto image = std::make_shared<ImageFeatures>();
  image->set.features.resize(features);
  return image;
}

Rigid3 pose_at(double x) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0)}; }

TEST(Map, KnowsAnObservationFromBothSides) {
  Map map;
  const KeyframeId k = map.add_keyframe(0, 0, pose_at(0), image_of(3));
  const LandmarkId l = map.add_landmark({0, 0, 1});
  EXPECT_TRUE(map.add_observation(l, k, 1));
  EXPECT_FALSE(map.add_observation(l, k, 2)) << "seen by this keyframe already";
  EXPECT_FALSE(map.add_observation(map.add_landmark({0, 0, 2}), k, 1)) << "the feature is taken";
  EXPECT_EQ(map.keyframe(k)->landmark_of_feature[1], l);
  EXPECT_EQ(map.landmark(l)->observations.size(), 1u);
  map.remove_observation(l, k);
  EXPECT_EQ(map.keyframe(k)->landmark_of_feature[1], kNoLandmark);
  map.check();
}

TEST(Map, CountsSharedLandmarks) {
  Map map;
  for (int i = 0; i < 3; ++i) map.add_keyframe(i, i, pose_at(i), image_of(10));
  for (int f = 0; f < 5; ++f) {
    const LandmarkId l = map.add_landmark({0, 0, 1});
    map.add_observation(l, 0, f);
    map.add_observation(l, 1, f);
    if (f < 2) map.add_observation(l, 2, f);
  }
  const auto covisible = map.covisible(0);
  ASSERT_EQ(covisible.size(), 2u);
  EXPECT_EQ(covisible[0], std::make_pair(1, 5));
  EXPECT_EQ(covisible[1], std::make_pair(2, 2));
  EXPECT_EQ(map.shared(0, 1), 5);
  EXPECT_EQ(map.shared(2, 0), 2);
  EXPECT_EQ(map.shared(0, 9), 0);
}

TEST(Map, MergingKeepsEveryObservationThatDoesNotConflict) {
  Map map;
  for (int i = 0; i < 3; ++i) map.add_keyframe(i, i, pose_at(i), image_of(4));
  const LandmarkId a = map.add_landmark({0, 0, 1}), b = map.add_landmark({0, 0, 1});
  map.add_observation(a, 0, 0);
  map.add_observation(a, 1, 0);
  map.add_observation(b, 1, 1);
  map.add_observation(b, 2, 1);
  map.merge_landmarks(a, b);
  EXPECT_EQ(map.landmark(a), nullptr);
  ASSERT_EQ(map.landmark(b)->observations.size(), 3u);
  EXPECT_EQ(map.landmark(b)->observations[1].feature, 1) << "keyframe 1 keeps what it saw of b";
  EXPECT_EQ(map.keyframe(1)->landmark_of_feature[0], kNoLandmark);
  map.check();
}

TEST(Map, ARemovedKeyframeMovesWithItsParent) {
  Map map;
  for (int i = 0; i < 4; ++i) map.add_keyframe(i, i, pose_at(i), image_of(1));
  map.remove_keyframe(1, 2);
  map.remove_keyframe(2, 3);
  Rigid3 pose;
  ASSERT_TRUE(map.camera_from_map(1, &pose));
  EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(1, 0, 0)).norm(), 0, 1e-12);
  map.set_pose(3, pose_at(13));
  ASSERT_TRUE(map.camera_from_map(1, &pose));
  EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(11, 0, 0)).norm(), 0, 1e-12);
  EXPECT_FALSE(map.camera_from_map(99, &pose));
  map.check();
}

TEST(Map, ForgetsTheOldestOfTheRemovedKeyframesAndNoOther) {
  Map map;
  for (int i = 0; i < 8; ++i) map.add_keyframe(i, i, pose_at(i), image_of(1));
  // A chain: 5 hangs on 1, which hangs on 2, which hangs on 6.
  map.remove_keyframe(5, 1);
  map.remove_keyframe(1, 2);
  map.remove_keyframe(2, 6);
  map.remove_keyframe(3, 7);
  map.forget_removed_keyframes(2);
  EXPECT_EQ(map.removed_keyframes().size(), 2u);
  Rigid3 pose;
  EXPECT_FALSE(map.camera_from_map(1, &pose));
  EXPECT_FALSE(map.camera_from_map(2, &pose));
  for (const KeyframeId left : {3, 5}) {
    ASSERT_TRUE(map.camera_from_map(left, &pose));
    EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(left, 0, 0)).norm(), 0, 1e-12);
  }
  map.remove_keyframe(6, 7);
  ASSERT_TRUE(map.camera_from_map(5, &pose)) << "what it hangs on may go later";
  EXPECT_NEAR((pose.inverse().translation - Eigen::Vector3d(5, 0, 0)).norm(), 0, 1e-12);
}

// A row of keyframes, each of which sees the points before it and beside it.
Map row(int keyframes, Random& random) {
  Map map;
  for (int i = 0; i < keyframes; ++i) map.add_keyframe(i, i, pose_at(i), image_of(3));
  for (int i = 0; i < keyframes; ++i) {
    const LandmarkId l = map.add_landmark({i + random.normal(), random.normal(), 5 + random.normal()});
    for (int k = std::max(0, i - 1); k <= std::min(keyframes - 1, i + 1); ++k) {
      map.add_observation(l, k, k - i + 1);
    }
  }
  return map;
}

const Sim3 kChange{2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                   Eigen::Vector3d(4, -5, 6)};

// Directions to landmarks that a keyframe sees, in its camera.
std::vector<Eigen::Vector3d> viewing_rays(const Map& map, KeyframeId keyframe) {
  std::vector<Eigen::Vector3d> directions;
  for (const LandmarkId l : map.keyframe(keyframe)->landmark_of_feature) {
    if (l == kNoLandmark) continue;
    directions.push_back((map.keyframe(keyframe)->camera_from_map * map.landmark(l)->x_in_map).normalized());
  }
  return directions;
}

void expect_same(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).norm(), 1e-12);
}

TEST(Map, WhatIsSeenStaysTheSameInAnotherFrameAndUnit) {
  Random random(5);
  Map map = row(6, random);
  map.remove_keyframe(2, 3);
  Rigid3 before;
  ASSERT_TRUE(map.camera_from_map(2, &before));
  const Map original = map;
  map.transform(kChange);
  map.check();
  for (const auto& entry : map.keyframes()) {
    const KeyframeId k = entry.first;
    expect_same(viewing_rays(map, k), viewing_rays(original, k));
    EXPECT_LT((map.keyframe(k)->center_in_map() - kChange * original.keyframe(k)->center_in_map()).norm(),
              1e-12);
  }
  Rigid3 after;
  ASSERT_TRUE(map.camera_from_map(2, &after));
  EXPECT_LT((after.inverse().translation - kChange * before.inverse().translation).norm(), 1e-12);
}

TEST(Map, TheSameSimilarityForAllKeyframesIsATransform) {
  Random random(6);
  Map map = row(6, random);
  map.remove_keyframe(2, 3);
  Map transformed = map;
  transformed.transform(kChange);
  std::map<KeyframeId, Sim3> each;
  for (const auto& entry : map.keyframes()) each[entry.first] = kChange;
  map.apply(each);
  map.check();
  for (KeyframeId k = 0; k < 6; ++k) {
    Rigid3 a, b;
    ASSERT_TRUE(map.camera_from_map(k, &a) && transformed.camera_from_map(k, &b));
    EXPECT_LT((a.translation - b.translation).norm(), 1e-12);
  }
  for (const LandmarkId l : map.landmark_ids()) {
    EXPECT_LT((map.landmark(l)->x_in_map - transformed.landmark(l)->x_in_map).norm(), 1e-12);
  }
}

TEST(Map, TakesInAnotherMap) {
  Random random(7);
  Map map = row(4, random), other = row(5, random);
  other.shift_frame_indices(100);
  other.remove_keyframe(1, 2);
  const Map original = other;
  const MergedIds added = map.merge(other, kChange);
  map.check();
  EXPECT_EQ(map.keyframes().size(), 4u + 4u);
  EXPECT_EQ(map.landmarks().size(), 4u + 5u);
  for (const auto& [id, keyframe] : original.keyframes()) {
    expect_same(viewing_rays(map, id + added.keyframes), viewing_rays(original, id));
    EXPECT_EQ(map.keyframe(id + added.keyframes)->frame_index, keyframe.frame_index);
  }
  Rigid3 removed, before;
  ASSERT_TRUE(map.camera_from_map(1 + added.keyframes, &removed) && original.camera_from_map(1, &before));
  EXPECT_LT((removed.inverse().translation - kChange * before.inverse().translation).norm(), 1e-12);
  EXPECT_GT(map.add_keyframe(999, 999, pose_at(0), image_of(1)), 4 + added.keyframes) << "ids are new";
}

// The invariants hold whatever is done to a map, in whatever order.
// As after many joins, or of a map file that was made by hand.
TEST(Map, IsNotMergedWhereIdsWouldOverflow) {
  const auto map_with = [](LandmarkId id) {
    std::vector<Keyframe> keyframes(2);
    std::vector<Landmark> landmarks(1);
    landmarks[0].id = id;
    for (int i = 0; i < 2; ++i) {
      keyframes[i].id = i;
      keyframes[i].frame_index = i;
      keyframes[i].image = image_of(1);
      landmarks[0].observations.push_back({i, 0});
    }
    return Map::restore(std::move(keyframes), std::move(landmarks), {}, ScaleSource::kMapUnits);
  };
  constexpr LandmarkId kLargest = std::numeric_limits<LandmarkId>::max();
  Map map = map_with(kLargest / 4);
  const Map other = map_with(kLargest / 4 + 1);
  EXPECT_FALSE(map.has_ids_for(other));
  EXPECT_THROW(map.merge(other, Sim3()), std::length_error);
  EXPECT_EQ(map.keyframes().size(), 2u);
  map.check();
  EXPECT_THROW(map_with(kLargest), std::invalid_argument);
}

TEST(Map, InvariantsHoldUnderRandomOperations) {
  Random random(1);
  Map map;
  for (int i = 0; i < 8; ++i) map.add_keyframe(i, i, pose_at(i), image_of(20));
  for (int step = 0; step < 5000; ++step) {
    const LandmarkId l = static_cast<LandmarkId>(random.index(60)),
                     other = static_cast<LandmarkId>(random.index(60));
    const KeyframeId k = static_cast<KeyframeId>(random.index(8));
    switch (random.index(12)) {
      case 0:
        map.add_landmark({0, 0, 1});
        break;
      case 1:
        map.remove_landmark(l);
        break;
      case 2:
        map.merge_landmarks(l, other);
        break;
      case 3:
        map.remove_observation(l, k);
        break;
      case 4:
        if (step % 500 == 0) map.remove_keyframe(k, static_cast<KeyframeId>(random.index(8)));
        break;
      default:
        map.add_observation(l, k, static_cast<int>(random.index(20)));
    }
    if (step % 50 == 0) {
      ASSERT_NO_THROW(map.check()) << "step " << step;
    }
  }
}

ImageFeaturesPtr view_image(int features) {
  auto image = std::make_shared<ImageFeatures>();
  image->set.features.resize(features);
  image->set.bearings.assign(features, Eigen::Vector3d::UnitZ());
  return image;
}

// What was made anew step by step is what is made at once.
void expect_up_to_date(Map* map) {
  MapViews at_once;
  at_once.touch_all();
  at_once.refresh(*map);
  const MapViews& views = map->views();
  ASSERT_EQ(views.keyframes().size(), map->keyframes().size());
  ASSERT_EQ(views.landmarks().size(), map->landmarks().size());
  for (const auto& [id, expected] : at_once.keyframes()) {
    const KeyframeView& view = views.keyframes().at(id);
    EXPECT_EQ(view.id, id);
    EXPECT_EQ(view.frame_index, expected.frame_index);
    EXPECT_EQ(view.camera_from_map.translation, expected.camera_from_map.translation);
    EXPECT_EQ(view.landmark_of_feature, expected.landmark_of_feature);
    EXPECT_EQ(view.covisible, expected.covisible);
    EXPECT_EQ(view.shared_landmarks, expected.shared_landmarks);
  }
  for (const auto& [id, x_in_map] : at_once.landmarks()) EXPECT_EQ(views.landmarks().at(id), x_in_map);
}

void edit_at_random(Random& random, Map* map) {
  const auto landmark = static_cast<LandmarkId>(random.index(60));
  const auto keyframe = static_cast<KeyframeId>(random.index(9));
  const Eigen::Vector3d x(random.normal(), random.normal(), 5);
  switch (random.index(13)) {
    case 0:
      map->add_landmark(x);
      break;
    case 1:
      map->remove_landmark(landmark);
      break;
    case 2:
      map->merge_landmarks(landmark, static_cast<LandmarkId>(random.index(60)));
      break;
    case 3:
      map->remove_observation(landmark, keyframe);
      break;
    case 4:
      map->set_pose(keyframe, Rigid3(Eigen::Quaterniond::Identity(), x));
      break;
    case 5:
      map->set_position(landmark, x);
      break;
    default:
      map->add_observation(landmark, keyframe, static_cast<int>(random.index(20)));
  }
}

TEST(MapViews, AreWhatTheMapIsAfterEachEdit) {
  Random random(1);
  Map map;
  for (int i = 0; i < 9; ++i) map.add_keyframe(i, i, Rigid3(), view_image(20));
  for (int step = 0; step < 600; ++step) {
    for (int i = 0; i < 5; ++i) edit_at_random(random, &map);
    ASSERT_NO_FATAL_FAILURE(expect_up_to_date(&map)) << "step " << step;
  }
  const Map copy = map;
  const Sim3 change{2, Eigen::Quaterniond::Identity(), {1, 2, 3}};
  map.rescale(3);
  expect_up_to_date(&map);
  map.transform(change);
  expect_up_to_date(&map);
  map.apply({{4, change}});
  expect_up_to_date(&map);
  map.remove_keyframe(4, 5);
  expect_up_to_date(&map);
  map.merge(copy, change);
  expect_up_to_date(&map);
  Map earlier = copy;
  expect_up_to_date(&earlier);
}

TEST(Map, ASnapshotIsTheMapAsItWas) {
  Random random(3);
  Map map;
  for (int i = 0; i < 9; ++i) map.add_keyframe(i, i, Rigid3(), view_image(20));
  for (int step = 0; step < 400; ++step) edit_at_random(random, &map);
  map.remove_keyframe(4, 5);
  const Map before = map;
  const Map::Snapshot snapshot = map.snapshot();
  for (int step = 0; step < 400; ++step) edit_at_random(random, &map);
  map.rescale(3);
  Map again = Map::of(snapshot);
  again.check();
  expect_up_to_date(&again);
  ASSERT_EQ(again.landmark_ids(), before.landmark_ids());
  for (const auto& [id, landmark] : before.landmarks()) {
    EXPECT_EQ(again.landmark(id)->x_in_map, landmark.x_in_map);
    EXPECT_EQ(again.landmark(id)->created_by, landmark.created_by);
    EXPECT_EQ(again.landmark(id)->observations.size(), landmark.observations.size());
  }
  ASSERT_EQ(again.keyframes().size(), before.keyframes().size());
  for (const auto& [id, keyframe] : before.keyframes()) {
    EXPECT_EQ(again.keyframe(id)->camera_from_map.translation, keyframe.camera_from_map.translation);
    EXPECT_EQ(again.keyframe(id)->landmark_of_feature, keyframe.landmark_of_feature);
    EXPECT_EQ(again.covisible(id), before.covisible(id));
  }
  EXPECT_EQ(again.removed_keyframes().size(), 1u);
  EXPECT_EQ(again.add_landmark({0, 0, 1}), Map(before).add_landmark({0, 0, 1}));
  EXPECT_EQ(again.add_keyframe(9, 9, Rigid3(), view_image(1)), 9);
}

TEST(MapViews, AnEarlierOneStaysAsItWas) {
  Map map;
  const KeyframeId first = map.add_keyframe(0, 0, Rigid3(), view_image(2));
  const KeyframeId second = map.add_keyframe(1, 1, Rigid3(), view_image(2));
  const LandmarkId l = map.add_landmark({0, 0, 1});
  map.add_observation(l, first, 0);
  const MapViews before = map.views();
  map.add_observation(l, second, 0);
  map.set_position(l, {0, 0, 2});
  map.views();
  EXPECT_TRUE(before.keyframes().at(first).covisible.empty());
  EXPECT_EQ(before.keyframes().at(second).landmark_of_feature[0], kNoLandmark);
  EXPECT_EQ(before.landmarks().at(l).z(), 1);
}

TEST(Map, KnowsWhatCameWithAKeyframe) {
  Random random(2);
  Map map;
  for (int i = 0; i < 6; ++i) {
    map.add_keyframe(i, i, Rigid3(), view_image(1));
    for (int n = 0; n < i; ++n) map.add_landmark({0, 0, 1});
  }
  map.remove_landmark(map.landmarks_created_by(4)[2]);
  map.remove_keyframe(5, 0);
  map.merge(Map(map), Sim3());
  for (KeyframeId id = 0; id < 12; ++id) {
    std::vector<LandmarkId> expected;
    for (const LandmarkId l : map.landmark_ids()) {
      if (map.landmark(l)->created_by == id) expected.push_back(l);
    }
    EXPECT_EQ(map.landmarks_created_by(id), expected) << id;
  }
}

}  // namespace

}  // namespace mono_pose_tracker
