#include "mono_pose_tracker/quality/quality_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "quality/path_precision.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// A walk past two boxes: of the points of the first box only `shared` are still observed in the second half.
Map walk(int keyframes, int shared) {
  constexpr int kPoints = 150;
  Random random(9);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene first = box_scene(kPoints, random), second = box_scene(kPoints, random);
  Map map;
  std::vector<LandmarkId> of_first, of_second;
  for (const Eigen::Vector3d& x : first.x_in_map) of_first.push_back(map.add_landmark(x));
  for (int p = 0; p < kPoints; ++p)
    of_second.push_back(p < shared ? of_first[p] : map.add_landmark(second.x_in_map[p]));
  SyntheticScene later = second;
  for (int p = 0; p < shared; ++p) later.x_in_map[p] = first.x_in_map[p];
  for (int k = 0; k < keyframes; ++k) {
    const bool is_second = 2 * k >= keyframes;
    add_view(is_second ? later : first, camera, camera_at({0.15 * k, 0, 0}, -0.5 * k * kDegree), 0.5, k,
             is_second ? of_second : of_first, random, &map);
  }
  return map;
}

MapEvidence evidence_of(const Map& map, const PathPrecision& path) {
  MapEvidence evidence;
  evidence.map = &map;
  evidence.path = &path;
  evidence.registered = map.keyframes().size();
  evidence.images = static_cast<std::int64_t>(evidence.registered);
  return evidence;
}

TEST(QualityReport, AMapOfOneSceneIsConfirmed) {
  const Map map = walk(12, 150);
  const QualityReport report = assess(evidence_of(map, path_precision(map)), {});
  EXPECT_TRUE(report.confirmed());
  EXPECT_TRUE(report.findings().empty());
}

TEST(QualityReport, TwoHalvesWithoutCommonLandmarksAreNot) {
  const Map map = walk(12, 0);
  const QualityReport report = assess(evidence_of(map, path_precision(map)), {});
  EXPECT_FALSE(report.confirmed());
  EXPECT_TRUE(report.has(FindingKind::kUncertainScale));
}

TEST(QualityReport, AMapOfFewImagesIsNot) {
  const Map map = walk(12, 150);
  const PathPrecision path = path_precision(map);
  MapEvidence evidence = evidence_of(map, path);
  evidence.images = 40;
  const QualityReport report = assess(evidence, {});
  EXPECT_FALSE(report.confirmed());
  ASSERT_TRUE(report.has(FindingKind::kFewImages));
  evidence.is_first = false;
  EXPECT_FALSE(assess(evidence, {}).has(FindingKind::kFewImages));
}

TEST(QualityReport, ATwoViewMapIsNot) {
  const Map map = walk(12, 150);
  const PathPrecision path = path_precision(map);
  MapEvidence evidence = evidence_of(map, path);
  evidence.rests_on_two_views = true;
  EXPECT_TRUE(assess(evidence, {}).has(FindingKind::kTwoViews));
}

TEST(ScaleCut, FewLandmarksCarryTheScaleLessExactly) {
  const ScaleCut many = weakest_scale_cut(walk(12, 100)), few = weakest_scale_cut(walk(12, 10));
  EXPECT_GT(few.log_scale_sigma, 2 * many.log_scale_sigma);
  EXPECT_EQ(few.frame_index, 6);
  EXPECT_TRUE(std::isinf(weakest_scale_cut(walk(12, 0)).log_scale_sigma));
}

// The information of near landmarks that end at a cut leaves a rounding error, larger than that of a far one.
TEST(ScaleCut, AFarLandmarkCarriesNoScale) {
  for (double depth = 3; depth < 6; depth += 0.1) {
    const std::vector<std::pair<Eigen::Vector3d, std::vector<KeyframeId>>> landmarks = {
        {{2, 0, depth}, {0, 1, 3, 4}}, {{3, 0, 5}, {1, 2, 5, 6}}, {{0, 0, 1e10}, {0, 1, 7, 8}}};
    auto image = std::make_shared<ImageFeatures>();
    image->camera = synthetic_camera();
    image->set.features.resize(landmarks.size());
    image->sigma_px.assign(landmarks.size(), 1);
    Map map;
    for (int k = 0; k < 9; ++k) map.add_keyframe(k, k, camera_at({1.0 * k, 0, 0}), image);
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      const LandmarkId id = map.add_landmark(landmarks[l].first);
      for (const KeyframeId k : landmarks[l].second) map.add_observation(id, k, static_cast<int>(l));
    }
    const ScaleCut cut = weakest_scale_cut(map);
    EXPECT_GE(cut.frame_index, 6) << depth;
    EXPECT_GT(cut.log_scale_sigma, 1e3) << depth;
  }
}

}  // namespace
}  // namespace mono_pose_tracker
