#include "mapping/projection_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/synthetic_map.h"

namespace mono_pose_tracker {
namespace {

constexpr double kRadiusPx = 6;

Map box_map() { return map_of(round_about(), synthetic_camera(), synthetic_camera()); }

// Removes every other observation of the keyframe; returns its landmarks.
std::set<LandmarkId> forget_half(KeyframeId id, Map* map) {
  std::set<LandmarkId> seen, forgotten;
  for (const LandmarkId l : map->keyframe(id)->landmark_of_feature) {
    if (l != kNoLandmark) seen.insert(l);
  }
  bool every_other = false;
  for (const LandmarkId l : seen) {
    if (!(every_other = !every_other)) continue;
    map->remove_observation(l, id);
    forgotten.insert(l);
  }
  return forgotten;
}

std::vector<LandmarkId> ids_of(const std::vector<LandmarkCandidate>& candidates) {
  std::vector<LandmarkId> ids;
  for (const LandmarkCandidate& c : candidates) ids.push_back(c.id);
  return ids;
}

TEST(UnobservedInView, WhatAKeyframeForgotIsFoundAtItsFeaturesAndNothingThatItSees) {
  Map map = box_map();
  const std::set<LandmarkId> forgotten = forget_half(5, &map);
  ASSERT_GT(forgotten.size(), 20u);
  const std::vector<LandmarkId> found =
      ids_of(unobserved_in_view(map, *map.keyframe(5), std::nullopt, kRadiusPx));
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  for (const LandmarkId l : forgotten) EXPECT_TRUE(std::binary_search(found.begin(), found.end(), l)) << l;
  for (const LandmarkId l : map.keyframe(5)->landmark_of_feature) {
    EXPECT_FALSE(l != kNoLandmark && std::binary_search(found.begin(), found.end(), l)) << l;
  }
}

TEST(UnobservedInView, OfAllIsTheSameAsOfEach) {
  Map map = box_map();
  forget_half(5, &map);
  const Keyframe& keyframe = *map.keyframe(5);
  const auto of_all = unobserved_in_view(map, keyframe, std::nullopt, kRadiusPx);
  const auto of_each = unobserved_in_view(map, keyframe, map.landmark_ids(), kRadiusPx);
  EXPECT_EQ(ids_of(of_all), ids_of(of_each));
  for (std::size_t i = 0; i < of_all.size(); ++i) EXPECT_EQ(of_all[i].descriptor, of_each[i].descriptor);
}

TEST(UnobservedInView, WhereTheKeyframeHasNoFeatureThereIsNone) {
  Map map = box_map();
  forget_half(5, &map);
  const Keyframe& keyframe = *map.keyframe(5);
  // Between the features: there is nothing to compare the candidate with.
  const Eigen::Vector2d pixel = keyframe.image->set.features[0].pixel.cast<double>();
  Eigen::Vector2d nearby = pixel;
  while (keyframe.image->grid.has_near(nearby, kRadiusPx)) nearby.x() += 1;
  ASSERT_TRUE(keyframe.image->camera.in_image(nearby));
  const Eigen::Vector3d bearing = keyframe.image->camera.bearing(nearby);
  const LandmarkId l = map.add_landmark(keyframe.camera_from_map.inverse() * (5 * bearing));
  const LandmarkId there =
      map.add_landmark(keyframe.camera_from_map.inverse() * (5 * keyframe.image->set.bearings[0]));
  const auto is_free = [&](int f) { return map.keyframe(4)->landmark_of_feature[f] == kNoLandmark; };
  int feature = 0;
  for (const LandmarkId id : {l, there}) {
    while (!is_free(feature)) map.remove_observation(map.keyframe(4)->landmark_of_feature[feature], 4);
    ASSERT_TRUE(map.add_observation(id, 4, feature++));
  }
  EXPECT_EQ(unobserved_in_view(map, keyframe, std::vector<LandmarkId>{l}, kRadiusPx).size(), 0u);
  EXPECT_EQ(unobserved_in_view(map, keyframe, std::vector<LandmarkId>{there}, kRadiusPx).size(), 1u);
}

}  // namespace
}  // namespace mono_pose_tracker
