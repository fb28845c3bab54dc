#include "mapping/epipolar_matcher.h"

#include <gtest/gtest.h>

#include <memory>

#include "known_scene.h"

namespace mono_pose_tracker {
namespace {

Keyframe keyframe(KnownScene& scene, int view) {
  Keyframe result;
  result.camera_from_map = KnownScene::pose(view);
  result.image = scene.frame(view).image;
  result.landmark_of_feature.assign(result.image->size(), kNoLandmark);
  return result;
}

EpipolarMatchOptions options() {
  EpipolarMatchOptions options;
  options.max_distance2 = stored_distance2(0.6);
  return options;
}

int count_seen_by_both(const KnownScene& scene) {
  int count = 0;
  for (const int point : scene.point_of.at(0)) count += scene.feature_of(1, point) >= 0;
  return count;
}

TEST(EpipolarMatcher, FindsWhatBothSee) {
  KnownScene scene(300);
  const Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  const std::vector<Match> matches = match_along_epipolar_lines(first, second, options());
  for (const Match& m : matches) EXPECT_EQ(scene.point_of[0][m.first], scene.point_of[1][m.second]);
  EXPECT_GT(matches.size(), 0.9 * count_seen_by_both(scene));
}

// Every point has a twin with the same descriptor elsewhere: descriptors alone could not tell them apart.
TEST(EpipolarMatcher, TheGeometryTellsTwinsApart) {
  KnownScene scene(300);
  for (int i = 0; i < 150; ++i) scene.scene.descriptors.row(i).copyTo(scene.scene.descriptors.row(150 + i));
  const Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  const std::vector<Match> matches = match_along_epipolar_lines(first, second, options());
  int wrong = 0;
  for (const Match& m : matches) wrong += scene.point_of[0][m.first] != scene.point_of[1][m.second];
  EXPECT_GT(matches.size(), 0.8 * count_seen_by_both(scene));
  EXPECT_LT(wrong, 0.05 * matches.size()) << "a twin that is alone near the line, its own point out of view";
}

TEST(EpipolarMatcher, LeavesFeaturesThatSeeALandmark) {
  KnownScene scene(300);
  Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  for (std::size_t f = 0; f < first.landmark_of_feature.size(); f += 2) first.landmark_of_feature[f] = 7;
  for (std::size_t f = 0; f < second.landmark_of_feature.size(); f += 3) second.landmark_of_feature[f] = 8;
  const std::vector<Match> matches = match_along_epipolar_lines(first, second, options());
  EXPECT_GT(matches.size(), 50u);
  for (const Match& m : matches) {
    EXPECT_EQ(first.landmark_of_feature[m.first], kNoLandmark);
    EXPECT_EQ(second.landmark_of_feature[m.second], kNoLandmark);
  }
}

TEST(EpipolarMatcher, OtherScalesAndOtherPosesGiveNothing) {
  KnownScene scene(300);
  const Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  Keyframe coarse = second;
  ImageFeatures features = *second.image;
  for (Feature& feature : features.set.features) feature.scale *= 4;
  coarse.image = std::make_shared<ImageFeatures>(features);
  EXPECT_TRUE(match_along_epipolar_lines(first, coarse, options()).empty());

  Keyframe elsewhere = second;  // as if it had moved downwards: the lines run across
  elsewhere.camera_from_map = camera_at({0, 0.5, 0}, 0.035);
  EXPECT_LT(match_along_epipolar_lines(first, elsewhere, options()).size(),
            0.2 * match_along_epipolar_lines(first, second, options()).size());
}

}  // namespace
}  // namespace mono_pose_tracker
