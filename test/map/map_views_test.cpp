#include "mono_pose_tracker/map/map_views.h"

#include <gtest/gtest.h>

#include "common/statistics.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {
namespace {

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
