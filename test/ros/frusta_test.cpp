#include "ros/messages.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

using visualization_msgs::Marker;

CameraParameters camera() {
  CameraParameters parameters;
  parameters.width = 640;
  parameters.height = 480;
  parameters.fx = parameters.fy = 500;
  parameters.cx = 319.5;
  parameters.cy = 239.5;
  parameters.distortion_model.clear();
  return parameters;
}

KeyframePose keyframe(double z, double turn = 0) {
  return {static_cast<std::int64_t>(1e9 * z),
          {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())), {0, 0, z}}};
}

void add_points(double z, int number, MapSnapshot* map) {
  for (int i = 0; i < number; ++i) {
    ColoredPoint point;
    point.x_in_map = Eigen::Vector3f(0.01f * static_cast<float>(i), 0, static_cast<float>(z));
    map->points.push_back(point);
  }
}

TEST(Frusta, AreAsDeepAsATenthOfWhatIsInView) {
  MapSnapshot map;
  map.keyframes = {keyframe(0)};
  add_points(3, 20, &map);
  EXPECT_NEAR(frustum_depth(map, camera()), 0.3, 1e-6);
}

TEST(Frusta, DoNotGrowAsTheMapIsLeftBehind) {
  // A car: most points lie behind, the newest keyframe sees a street as deep as the first did.
  MapSnapshot map;
  for (int i = 0; i <= 100; ++i) {
    map.keyframes.push_back(keyframe(i));
    add_points(i + 3, 20, &map);
  }
  EXPECT_NEAR(frustum_depth(map, camera()), 0.2, 0.01);  // 1, 2 and 3 ahead
}

TEST(Frusta, HaveADepthWithoutPointsOrKeyframes) {
  MapSnapshot map;
  EXPECT_GT(frustum_depth(map, camera()), 0);
  map.keyframes = {keyframe(0)};
  EXPECT_GT(frustum_depth(map, camera()), 0);
}

TEST(Frusta, KeyframesAreThinned) {
  std::vector<KeyframePose> keyframes;
  for (int i = 0; i < 100; ++i) keyframes.push_back(keyframe(0.01 * i));
  const std::vector<KeyframePose> drawn = thinned_keyframes(keyframes, 0.1998);
  ASSERT_EQ(drawn.size(), 10u);
  EXPECT_EQ(drawn.front().stamp_ns, keyframes.back().stamp_ns) << "the newest is always there";
  for (std::size_t i = 1; i < drawn.size(); ++i) {
    const double step =
        (drawn[i].map_from_camera.translation - drawn[i - 1].map_from_camera.translation).norm();
    EXPECT_NEAR(step, 0.1, 1e-9);
  }
}

TEST(Frusta, ATurnOnTheSpotIsShown) {
  EXPECT_EQ(thinned_keyframes({keyframe(0, 0), keyframe(0, 0.1), keyframe(0, 1)}, 0.1).size(), 2u);
}

TEST(Frusta, LongPathsStayLegible) {
  std::vector<KeyframePose> keyframes;
  for (int i = 0; i < 5000; ++i) keyframes.push_back(keyframe(i));
  EXPECT_LE(thinned_keyframes(keyframes, 0.1).size(), 200u);
}

TEST(Frusta, TheCameraIsDrawnWhereItIs) {
  std_msgs::Header header;
  header.frame_id = "map";
  const Rigid3 pose = keyframe(7).map_from_camera;
  const Marker marker = to_camera_marker(header, camera(), &pose, 0.25);
  EXPECT_EQ(marker.action, Marker::ADD);
  EXPECT_EQ(marker.header.frame_id, "map");
  ASSERT_FALSE(marker.points.empty());
  double low = 1e9, high = -1e9;
  for (const geometry_msgs::Point& point : marker.points) {
    low = std::min(low, point.z);
    high = std::max(high, point.z);
  }
  EXPECT_NEAR(low, 7, 1e-9) << "its tip is the camera's centre";
  EXPECT_NEAR(high, 7.375, 1e-9) << "it looks forward";
}

TEST(Frusta, ALostCameraIsTakenAway) {
  const Marker marker = to_camera_marker({}, camera(), nullptr, 0.25);
  EXPECT_EQ(marker.action, Marker::DELETE);
}

}  // namespace
}  // namespace mono_pose_tracker
