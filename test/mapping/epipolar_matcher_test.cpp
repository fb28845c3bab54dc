#include "mapping/epipolar_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

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

// Descriptors of which any two are about as far apart as two of one leaf's, .36, however little they have to
// do with each other.
void make_look_alike(KnownScene* scene) {
  cv::Mat& descriptors = scene->scene.descriptors;
  for (int i = 0; i < descriptors.rows; ++i) {
    for (int k = 0; k < descriptors.cols; ++k) {
      descriptors.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(30 + scene->random.index(40));
    }
  }
}

/// The keyframe with the features of these points only.
template <typename Wanted>
Keyframe keyframe_of(KnownScene& scene, int view, Wanted wanted) {
  Keyframe result = keyframe(scene, view);
  std::vector<char> flags;
  for (const int point : scene.point_of[view]) flags.push_back(wanted(point) ? 1 : 0);
  result.image = select_features(*result.image, flags, scene.camera.width(), scene.camera.height());
  result.landmark_of_feature.assign(result.image->size(), kNoLandmark);
  std::vector<int>& points = scene.point_of[view];
  points.erase(std::remove_if(points.begin(), points.end(), [&](int p) { return !wanted(p); }), points.end());
  return result;
}

TEST(EpipolarMatcher, WhereNothingIsSeenByBothChanceIsNotTaken) {
  KnownScene scene(1600);
  make_look_alike(&scene);
  const Keyframe first = keyframe_of(scene, 0, [](int point) { return point < 800; });
  const Keyframe second = keyframe_of(scene, 1, [](int point) { return point >= 800; });
  EpipolarMatchOptions mutual = options();
  mutual.min_ratio = 1;  // it would leave out most of these, which are as far from one as from another
  EXPECT_LT(match_along_epipolar_lines(first, second, mutual).size(), 10u);
  mutual.max_chance_share = 1e9;
  EXPECT_GT(match_along_epipolar_lines(first, second, mutual).size(), 50u);
}

TEST(EpipolarMatcher, OfLookAlikesMostAreRight) {
  KnownScene scene(1600);
  make_look_alike(&scene);
  const Keyframe first = keyframe(scene, 0);
  const Keyframe second = keyframe_of(scene, 1, [](int point) { return point % 2 == 0 || point > 1000; });
  EpipolarMatchOptions mutual = options();
  mutual.min_ratio = 1;
  const std::vector<Match> matches = match_along_epipolar_lines(first, second, mutual);
  int wrong = 0;
  for (const Match& m : matches) wrong += scene.point_of[0][m.first] != scene.point_of[1][m.second];
  EXPECT_GT(matches.size(), 0.8 * count_seen_by_both(scene));
  EXPECT_LT(wrong, 0.3 * matches.size()) << "a fifth is asked for, by chance it may be more";
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
