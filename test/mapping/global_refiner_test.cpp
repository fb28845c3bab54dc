#include "mapping/global_refiner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "common/rotation.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// Keyframe kLost shows other points, of which nothing else in the recording tells.
class GlobalRefinerTest : public ::testing::Test {
 protected:
  static constexpr int kKeyframes = 24, kPoints = 200, kLost = 12;

  // A camera goes along a box of points with the jitter of a hand.
  static Rigid3 true_pose(int k) {
    return camera_at({0.06 * k, 0.004 * std::sin(2 * k), 0}, -0.5 * k * kDegree);
  }

  // error: of the position of keyframe kLost and of the points that it shows.
  std::set<KeyframeId> refined(const Eigen::Vector3d& error) {
    Random random(5);
    const SyntheticScene scene = box_scene(kPoints, random), other = box_scene(kPoints, random);
    const MapperOptions options = TrackerOptions().mapper(synthetic_camera().focal());
    Map& map = atlas_.begin(1, options).map;
    std::vector<LandmarkId> landmarks, others;
    for (const Eigen::Vector3d& x : scene.x_in_map) landmarks.push_back(map.add_landmark(x));
    for (const Eigen::Vector3d& x : other.x_in_map) others.push_back(map.add_landmark(x + error));
    for (int k = 0; k < kKeyframes; ++k) {
      add_view(k == kLost ? other : scene, synthetic_camera(), true_pose(k), 0.5, k,
               k == kLost ? others : landmarks, random, &map);
    }
    const Rigid3 lost = true_pose(kLost);
    map.set_pose(kLost, {lost.rotation, lost.translation - lost.rotation * error});
    ViewGraph graph(view_graph_options(options));
    GlobalRefiner refiner(options, &atlas_, &graph);
    refiner.connect();
    return refiner.refine();
  }

  Atlas atlas_;
};

TEST_F(GlobalRefinerTest, ARightMapStaysAsItIs) {
  EXPECT_TRUE(refined({0, 0, 0}).empty());
  EXPECT_EQ(atlas_.map().keyframes().size(), static_cast<std::size_t>(kKeyframes));
}

// No match of the view graph speaks against it, only the motion of the others.
TEST_F(GlobalRefinerTest, AKeyframeFarOffTheMotionOfTheOthersIsRemoved) {
  EXPECT_EQ(refined({0, 0.5, 0}), (std::set<KeyframeId>{kLost}));
  EXPECT_EQ(atlas_.map().keyframe(kLost), nullptr);
  for (const auto& [id, keyframe] : atlas_.map().keyframes()) {
    EXPECT_LT((keyframe.center_in_map() - true_pose(static_cast<int>(id)).inverse().translation).norm(),
              0.01);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
