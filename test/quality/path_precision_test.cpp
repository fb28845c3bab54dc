#include "quality/path_precision.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/quality/quality_report.h"
#include "optimization/map_adjustment.h"
#include "support/mapper_tests.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kNoisePx = 0.5;

bool is_known(const PathPrecision& path) {
  const QualityOptions options;
  return path.share() <= options.max_path_sigma && path.sigma <= options.max_extent_sigma * path.extent;
}

std::vector<Eigen::Vector3d> sideways(int keyframes, double step) {
  std::vector<Eigen::Vector3d> centers;
  for (int k = 0; k < keyframes; ++k) centers.emplace_back(step * k, 0.01 * step * k * k, 0);
  return centers;
}

Map map_along(const std::vector<Eigen::Vector3d>& centers, const SyntheticScene& scene, Random& random) {
  Map map;
  std::vector<LandmarkId> landmarks;
  for (const Eigen::Vector3d& x : scene.x_in_map) landmarks.push_back(map.add_landmark(x));
  for (std::size_t k = 0; k < centers.size(); ++k) {
    add_view(scene, synthetic_camera(), camera_at(centers[k]), kNoisePx, static_cast<int>(k), landmarks,
             random, &map);
  }
  return map;
}

// Root mean square error in the map's unit.
double root_mean_square_error(const Map& map, const std::vector<Eigen::Vector3d>& centers) {
  std::vector<Eigen::Vector3d> found;
  for (const auto& entry : map.keyframes()) found.push_back(entry.second.center_in_map());
  return aligned_rmse(centers, found);
}

// Over many maps with random errors.
TEST(PathPrecision, SaysByHowMuchThePathIsOff) {
  constexpr int kMaps = 20;
  double said = 0, is = 0;
  for (int i = 0; i < kMaps; ++i) {
    Random random(100 + i);
    const std::vector<Eigen::Vector3d> centers = sideways(6, 0.1);
    const SyntheticScene scene = box_scene(60, random);
    Map map = map_along(centers, scene, random);
    ASSERT_TRUE(adjust_map(BundleOptions(), &map).usable);
    const PathPrecision path = path_precision(map);
    EXPECT_TRUE(is_known(path));
    said += path.sigma * path.sigma;
    is += std::pow(root_mean_square_error(map, centers), 2);
  }
  EXPECT_NEAR(std::sqrt(said / is), 1, 0.25);
}

TEST(PathPrecision, IsTheSameInAnyUnit) {
  Random random(7);
  const SyntheticScene scene = box_scene(60, random);
  Map map = map_along(sideways(6, 0.1), scene, random);
  const PathPrecision before = path_precision(map);
  map.transform(Sim3(50, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())), {1, 2, 3}));
  const PathPrecision after = path_precision(map);
  EXPECT_NEAR(after.length, 50 * before.length, 1e-6 * after.length);
  EXPECT_NEAR(after.share(), before.share(), 1e-3 * before.share());
}

// A step of a tenth at a distance of 4000 is a thousandth of a pixel.
TEST(PathPrecision, NobodyKnowsAPathBeforeASkyline) {
  Random random(8);
  const SyntheticScene scene(skyline_points(200, 0, random), random);
  EXPECT_FALSE(is_known(path_precision(map_along(sideways(8, 0.1), scene, random))));
}

TEST(PathPrecision, AFewThingsThatAreNearTellIt) {
  Random random(9);
  const SyntheticScene scene(skyline_points(200, 60, random), random);
  EXPECT_TRUE(is_known(path_precision(map_along(sideways(8, 0.1), scene, random))));
}

TEST(PathPrecision, APointAtALensDoesNotHideTheRest) {
  for (const double nearness : {1e-2, 1e-3, 1e-5, 1e-7, 1e-9}) {
    Random random(10);
    const SyntheticScene scene = box_scene(200, random);
    Map map = map_along(sideways(8, 0.1), scene, random);
    const double share = path_precision(map).share();
    const LandmarkId at_lens = map.landmarks().begin()->first;
    const Eigen::Vector3d center = map.keyframe(0)->center_in_map();
    map.set_position(at_lens, center + nearness * (map.landmark(at_lens)->x_in_map - center));
    EXPECT_NEAR(path_precision(map).share(), share, 0.1 * share) << nearness;
  }
}

// A camera at rest moves back and forth by noise: the longer it rests, the longer the path.
TEST(PathPrecision, NoiseIsNoWay) {
  Random random(11);
  const SyntheticScene scene = box_scene(20, random);
  const std::vector<Eigen::Vector3d> nowhere(150, Eigen::Vector3d::Zero());
  Map map = map_along(nowhere, scene, random);
  ASSERT_TRUE(adjust_map(BundleOptions(), &map).usable);
  const PathPrecision path = path_precision(map);
  EXPECT_LT(path.share(), QualityOptions().max_path_sigma);
  EXPECT_FALSE(is_known(path));
}

TEST(PathPrecision, AVeryLargeMapIsAskedInParts) {
  Random random(12);
  const SyntheticScene room = box_scene(30, random), skyline(skyline_points(30, 0, random), random);
  EXPECT_TRUE(is_known(path_precision(map_along(sideways(301, 0.001), room, random))));
  EXPECT_FALSE(is_known(path_precision(map_along(sideways(301, 0.001), skyline, random))));
}

// Half of a recording before a skyline: its positions are not known, however well those of the others are.
TEST(PathPrecision, OfALargeMapTheLeastCertainPartCounts) {
  Random random(13);
  const SyntheticScene room = box_scene(30, random), skyline(skyline_points(30, 0, random), random);
  const std::vector<Eigen::Vector3d> centers = sideways(400, 0.001);
  Map map;
  for (const SyntheticScene* seen : {&room, &skyline}) {
    std::vector<LandmarkId> landmarks;
    for (const Eigen::Vector3d& x : seen->x_in_map) landmarks.push_back(map.add_landmark(x));
    const int begin = seen == &room ? 0 : 200;
    for (int k = begin; k < begin + 200; ++k) {
      add_view(*seen, synthetic_camera(), camera_at(centers[k]), kNoisePx, k, landmarks, random, &map);
    }
  }
  EXPECT_FALSE(is_known(path_precision(map)));
}

TEST(PathPrecision, OfAnEmptyMapNothingTellsIt) { EXPECT_FALSE(is_known(path_precision(Map()))); }

}  // namespace
}  // namespace mono_pose_tracker
