#include "mapping/rigidity_watch.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr int kPairPoints = 200;

// Two keyframes; in the second the left part of the scene is displaced by `moved`.
Map make_pair_map(double moved, double seconds) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kPairPoints, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < 2; ++k) {
    SyntheticScene now = scene;
    for (Eigen::Vector3d& x : now.x_in_map) {
      if (k == 1 && x.x() < -0.3) x.y() += moved;
    }
    const Rigid3 camera_from_map = camera_at({0.06 * k, 0, 0}, 0);
    std::vector<int> point_of;
    const Frame frame = synthetic_frame(now, camera, camera_from_map, 0.5, k, random, &point_of);
    const KeyframeId id =
        map.add_keyframe(k, static_cast<std::int64_t>(seconds * k * 1e9), camera_from_map, frame.image);
    if (k == 1) continue;
    for (std::size_t f = 0; f < point_of.size(); ++f) {
      map.add_observation(ids[point_of[f]], id, static_cast<int>(f));
    }
  }
  return map;
}

TEST(RigidityWatch, APartThatGoesAnotherWayIsADoubtUntilItDoesNot) {
  RigidityWatch watch;
  watch.ask(make_pair_map(0, 1), MatchOptions());
  EXPECT_TRUE(watch.doubt().empty());
  watch.ask(make_pair_map(0.2, 3), MatchOptions());
  EXPECT_NE(watch.doubt().find("away from their position"), std::string::npos) << watch.doubt();
  watch.ask(make_pair_map(0, 5), MatchOptions());
  EXPECT_TRUE(watch.doubt().empty());
}

TEST(RigidityWatch, ItAsksOnceASecond) {
  RigidityWatch watch;
  watch.ask(make_pair_map(0, 1), MatchOptions());
  watch.ask(make_pair_map(0.2, 1.5), MatchOptions());
  EXPECT_TRUE(watch.doubt().empty());
  watch.ask(make_pair_map(0.2, 2.1), MatchOptions());
  EXPECT_FALSE(watch.doubt().empty());
}

}  // namespace
}  // namespace mono_pose_tracker
