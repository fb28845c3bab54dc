#include "mapping/known_baseline.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// Two keyframes `way` apart, x to the right, that observe the same points at depths of 3 to 6.
Map two_keyframes(double way, int points) {
  Random random(31);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(points, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < 2; ++k) {
    const Rigid3 camera_from_map = camera_at({way * k, 0, 0}, 0.1 * k);
    add_view(scene, camera, camera_from_map, 0.5, k, ids, random, &map);
  }
  return map;
}

bool is_known(const Map& map) {
  return is_baseline_known(map, map.keyframes().begin()->second, map.keyframes().rbegin()->second);
}

// A pixel is 0.0017 rad, or 7.5 mm at a distance of 4.5. A hundred points determine a position ten times as
// well, except for the correlation with a rotation of the camera.
TEST(KnownBaseline, AWayThatIsFarMoreThanThePosesAreOffIsKnown) {
  EXPECT_TRUE(is_known(two_keyframes(0.3, 200)));
  EXPECT_TRUE(is_known(two_keyframes(0.1, 200)));
}

TEST(KnownBaseline, ACameraThatOnlyTurnsHasMovedByWhatItsPosesAreOff) {
  EXPECT_FALSE(is_known(two_keyframes(0, 200)));
  EXPECT_FALSE(is_known(two_keyframes(0.002, 200)));
}

TEST(KnownBaseline, FewerPointsTellLess) {
  EXPECT_TRUE(is_known(two_keyframes(0.05, 400)));
  EXPECT_FALSE(is_known(two_keyframes(0.05, 5)));
}

// Points on one line leave a rotation about it free, and with it a lateral displacement: further points are
// needed.
TEST(KnownBaseline, PointsThatDoNotTellThePoseTellNoWay) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) points.push_back({0.01 * i - 0.5, 0, 4});
  const auto is_known_of = [&](const std::vector<Eigen::Vector3d>& of_scene) {
    const SyntheticScene seen(of_scene, random);
    Map map;
    std::vector<LandmarkId> ids;
    for (const Eigen::Vector3d& x : seen.x_in_map) ids.push_back(map.add_landmark(x));
    for (int k = 0; k < 2; ++k) {
      add_view(seen, camera, camera_at({0, 0.3 * k, 0}, 0), 0, k, ids, random, &map);
    }
    return is_known(map);
  };
  EXPECT_FALSE(is_known_of(points));
  for (const Eigen::Vector3d& x : box_scene(200, random).x_in_map) points.push_back(x);
  EXPECT_TRUE(is_known_of(points));
}

}  // namespace
}  // namespace mono_pose_tracker
