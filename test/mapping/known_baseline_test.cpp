#include "mapping/known_baseline.h"

#include <gtest/gtest.h>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// Two keyframes `way` apart, x to the right, that see the same points at a depth of 3 to 6.
Map two_keyframes(double way, int points) {
  Random random(31);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(points, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < 2; ++k) {
    const Rigid3 camera_from_map = camera_at({way * k, 0, 0}, 0.1 * k);
    std::vector<int> point_of;
    const Frame frame = synthetic_frame(scene, camera, camera_from_map, 0.5, k, random, &point_of);
    const KeyframeId id = map.add_keyframe(k, k * 100000000, camera_from_map, frame.image);
    for (std::size_t f = 0; f < point_of.size(); ++f) {
      map.add_observation(ids[point_of[f]], id, static_cast<int>(f));
    }
  }
  return map;
}

bool is_known(const Map& map) {
  return is_baseline_known(map, map.keyframes().begin()->second, map.keyframes().rbegin()->second);
}

// A pixel is 0.0017 rad: of points 4.5 away it is 7.5 mm, and a hundred of them tell a place ten times as
// well, but for what a turn of the camera could do in its stead.
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

}  // namespace
}  // namespace mono_pose_tracker
