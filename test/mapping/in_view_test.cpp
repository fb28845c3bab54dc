#include "mapping/in_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

Map map_of_views(const SyntheticScene& scene, const std::vector<Rigid3>& cameras_from_map) {
  Random random(3);
  const CameraModel camera = synthetic_camera();
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (std::size_t k = 0; k < cameras_from_map.size(); ++k) {
    add_view(scene, camera, cameras_from_map[k], 0.3, static_cast<int>(k), ids, random, &map);
  }
  return map;
}

TrackingMap view_of(Map map) {
  TrackingMap view;
  view.keyframes = map.views().keyframes();
  view.landmarks = map.views().landmarks();
  return view;
}

TEST(StaysInView, AHeadThatTurnsOnceRound) {
  Random random(3);
  std::vector<Rigid3> cameras_from_head;
  for (int k = 0; k < 18; ++k) cameras_from_head.push_back(before_turned_head(20 * k * kDegree));
  const Map map = map_of_views(synthetic_head(150, random), cameras_from_head);
  EXPECT_TRUE(stays_in_view(map));
  EXPECT_FALSE(has_left_behind(view_of(map), synthetic_camera(), cameras_from_head.back()));
  const Rigid3 half_out(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.6, 0, 0));
  EXPECT_FALSE(has_left_behind(view_of(map), synthetic_camera(), half_out * cameras_from_head.back()));
}

TEST(StaysInView, NotAHeadSomeOfWhoseKeyframesAreElsewhere) {
  Random random(3);
  const Rigid3 aside(Eigen::Quaterniond(Eigen::AngleAxisd(60 * kDegree, Eigen::Vector3d::UnitY())),
                     Eigen::Vector3d::Zero());
  std::vector<Rigid3> cameras_from_head;
  for (int k = 0; k < 18; ++k) cameras_from_head.push_back(before_turned_head(20 * k * kDegree));
  Map map = map_of_views(synthetic_head(150, random), cameras_from_head);
  for (KeyframeId id = 0; id < 6; ++id) map.set_pose(id, aside * map.keyframe(id)->camera_from_map);
  EXPECT_FALSE(stays_in_view(map));
}

TEST(StaysInView, AStreetThatIsDrivenThroughDoesNot) {
  Random random(3);
  std::vector<Eigen::Vector3d> walls;
  for (int i = 0; i < 300; ++i) {
    walls.emplace_back(i % 2 == 0 ? -4 : 4, random.uniform(-3, 1.5), random.uniform(3, 25));
  }
  std::vector<Rigid3> cameras_from_map;
  for (int k = 0; k < 9; ++k)
    cameras_from_map.emplace_back(Eigen::Quaterniond::Identity(), -1.0 * k * Eigen::Vector3d::UnitZ());
  const Map map = map_of_views(SyntheticScene(walls, random), cameras_from_map);
  EXPECT_FALSE(stays_in_view(map));
  EXPECT_TRUE(has_left_behind(view_of(map), synthetic_camera(), cameras_from_map.back()));
  EXPECT_FALSE(has_left_behind(view_of(map), synthetic_camera(), cameras_from_map.front()));
}

// A lens of 240 degrees shows points whose z is negative: they are not behind the camera.
TEST(HasLeftBehind, NotWhatAFisheyeLensStillShows) {
  CameraParameters parameters;
  parameters.width = parameters.height = 1000;
  parameters.fx = parameters.fy = 500 / (120 * kDegree);
  parameters.cx = parameters.cy = 500;
  parameters.distortion_model = "equidistant";
  parameters.distortion = {0, 0, 0, 0};
  const CameraModel fisheye = CameraModel(parameters);
  const auto ring = [](const std::function<double(int)>& z) {
    TrackingMap map;
    for (int i = 0; i < 40; ++i) {
      const double azimuth = 9 * i * kDegree;
      map.landmarks.set(i, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), z(i)));
    }
    return map;
  };
  EXPECT_FALSE(has_left_behind(ring([](int) { return -0.1; }), fisheye, Rigid3())) << "all is in view";
  EXPECT_TRUE(has_left_behind(ring([](int i) { return i % 2 == 0 ? -0.1 : -2.0; }), fisheye, Rigid3()));
}

}  // namespace
}  // namespace mono_pose_tracker
