#include "mapping/epipolar_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/essential.h"
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

// Nearest and second nearest features near the epipolar lines, by exhaustive comparison.
std::vector<Match> by_comparing_all(const Keyframe& first, const Keyframe& second,
                                    const EpipolarMatchOptions& options) {
  const Eigen::Matrix3d essential =
      essential_matrix(second.camera_from_map * first.camera_from_map.inverse());
  const int size1 = first.image->size(), size2 = second.image->size();
  std::vector<NearestTwo> of_first(size1), of_second(size2);
  for (int i = 0; i < size1; ++i) {
    const Eigen::Vector3d normal = (essential * first.image->set.bearings[i]).normalized();
    for (int j = 0; j < size2; ++j) {
      if (std::abs(normal.dot(second.image->set.bearings[j])) > options.max_error_rad) continue;
      const double ratio = first.image->set.features[i].scale / second.image->set.features[j].scale;
      if (std::max(ratio, 1 / ratio) > options.max_scale_ratio) continue;
      const int d2 = descriptor_distance2(first.image->set.descriptor(i), second.image->set.descriptor(j));
      of_first[i].offer(j, d2);
      of_second[j].offer(i, d2);
    }
  }
  std::vector<Match> matches;
  for (int i = 0; i < size1; ++i) {
    const NearestTwo& b = of_first[i];
    if (b.index < 0 || b.best > options.max_distance2 || of_second[b.index].index != i) continue;
    if (b.best * options.min_ratio * options.min_ratio <= b.second)
      matches.push_back({i, b.index, b.best, 0});
  }
  return matches;
}

TEST(EpipolarMatcher, NoneThatIsNearItsLineIsPassedOver) {
  KnownScene scene(2000);
  EpipolarMatchOptions all_kept = options();
  all_kept.max_chance_share = 1;
  for (const int view : {1, 2, 3}) {
    const Keyframe first = keyframe(scene, 0), second = keyframe(scene, view);
    const std::vector<Match> found = match_along_epipolar_lines(first, second, all_kept);
    const std::vector<Match> expected = by_comparing_all(first, second, all_kept);
    ASSERT_GT(expected.size(), 500U);
    // A match may be nearer in the decoy strip, or just within the limit.
    std::size_t same = 0;
    for (const Match& m : found) {
      same += std::any_of(expected.begin(), expected.end(),
                          [&](const Match& e) { return e.first == m.first && e.second == m.second; });
    }
    EXPECT_GE(same, 0.995 * expected.size());
    EXPECT_LE(found.size(), same + 0.005 * expected.size());
  }
}

// Equal descriptors on both sides of a boundary between threads are included.
TEST(EpipolarMatcher, AnyNumberOfThreadsFindsTheSame) {
  KnownScene scene(1200);
  for (int i = 0; i < 600; ++i) scene.scene.descriptors.row(i).copyTo(scene.scene.descriptors.row(600 + i));
  const Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  EpipolarMatchOptions shared = options();
  shared.max_error_rad *= 20;  // so that both copies are near the line
  const std::vector<Match> expected = match_along_epipolar_lines(first, second, shared);
  EXPECT_GT(expected.size(), 50u);
  for (const int threads : {2, 3, 5}) {
    shared.threads = threads;
    const std::vector<Match> found = match_along_epipolar_lines(first, second, shared);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].first, expected[i].first);
      EXPECT_EQ(found[i].second, expected[i].second);
      EXPECT_EQ(found[i].distance2, expected[i].distance2);
    }
  }
}

// Every point has a copy with the same descriptor elsewhere: descriptors alone cannot separate them.
TEST(EpipolarMatcher, TheGeometryTellsEqualDescriptorsApart) {
  KnownScene scene(300);
  for (int i = 0; i < 150; ++i) scene.scene.descriptors.row(i).copyTo(scene.scene.descriptors.row(150 + i));
  const Keyframe first = keyframe(scene, 0), second = keyframe(scene, 1);
  const std::vector<Match> matches = match_along_epipolar_lines(first, second, options());
  int wrong = 0;
  for (const Match& m : matches) wrong += scene.point_of[0][m.first] != scene.point_of[1][m.second];
  EXPECT_GT(matches.size(), 0.8 * count_seen_by_both(scene));
  EXPECT_LT(wrong, 0.05 * matches.size()) << "a copy that is alone near the line, its own point out of view";
}

// Similar descriptors: any two differ by about 0.36, as those of two views of one leaf, related or not.
void make_similar(KnownScene* scene) {
  cv::Mat& descriptors = scene->scene.descriptors;
  for (int i = 0; i < descriptors.rows; ++i) {
    for (int k = 0; k < descriptors.cols; ++k) {
      descriptors.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(30 + scene->random.index(40));
    }
  }
}

/// The keyframe reduced to the features of these points.
template <typename Wanted>
Keyframe keyframe_of(KnownScene& scene, int view, Wanted wanted) {
  Keyframe result = keyframe(scene, view);
  std::vector<char> flags;
  for (const int point : scene.point_of[view]) flags.push_back(wanted(point) ? 1 : 0);
  result.image = select_features(*result.image, flags);
  result.landmark_of_feature.assign(result.image->size(), kNoLandmark);
  std::vector<int>& points = scene.point_of[view];
  points.erase(std::remove_if(points.begin(), points.end(), [&](int p) { return !wanted(p); }), points.end());
  return result;
}

TEST(EpipolarMatcher, WhereNothingIsSeenByBothChanceIsNotTaken) {
  KnownScene scene(1600);
  make_similar(&scene);
  const Keyframe first = keyframe_of(scene, 0, [](int point) { return point < 800; });
  const Keyframe second = keyframe_of(scene, 1, [](int point) { return point >= 800; });
  EpipolarMatchOptions mutual = options();
  mutual.min_ratio = 1;  // it would exclude most of these, which are equally far from each other
  EXPECT_LT(match_along_epipolar_lines(first, second, mutual).size(), 10u);
  mutual.max_chance_share = 1e9;
  EXPECT_GT(match_along_epipolar_lines(first, second, mutual).size(), 50u);
}

TEST(EpipolarMatcher, OfSimilarFeaturesMostMatchesAreRight) {
  KnownScene scene(1600);
  make_similar(&scene);
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

  Keyframe elsewhere = second;  // displaced downwards: the epipolar lines are perpendicular
  elsewhere.camera_from_map = camera_at({0, 0.5, 0}, 0.035);
  EXPECT_LT(match_along_epipolar_lines(first, elsewhere, options()).size(),
            0.2 * match_along_epipolar_lines(first, second, options()).size());
}

}  // namespace
}  // namespace mono_pose_tracker
