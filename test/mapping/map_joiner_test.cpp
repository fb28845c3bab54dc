#include "mono_pose_tracker/mapping/map_joiner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "support/map_of_views.h"

namespace mono_pose_tracker {
namespace {

class MapJoinerTest : public testing::Test {
 protected:
  Map map_from(const std::vector<Rigid3>& poses) const { return map_of(poses, camera_, camera_); }

  const CameraModel camera_ = synthetic_camera();
  const MapperOptions options_ = TrackerOptions().mapper(camera_.focal());
  const std::vector<Rigid3> way_ = round_about();
  const Map other_ = map_from({way_.begin(), way_.begin() + 7});
};

TEST_F(MapJoinerTest, PointsOfKnownDepthTellTheScale) {
  Map map = map_from({way_.begin() + 5, way_.end()});
  map.rescale(3);
  const std::optional<MapTie> tie = tie_keyframe(options_, map, 1, other_, 6);
  ASSERT_TRUE(tie);
  EXPECT_NEAR(std::log(3 * tie->other_from_map.scale), 0, 0.05);
  EXPECT_LT(tie->log_scale_sigma, 0.1);
}

TEST_F(MapJoinerTest, PointsWithoutParallaxTellNoScale) {
  // As far apart as the camera shakes: .2 px of parallax.
  std::vector<Rigid3> still;
  for (int k = 0; k < 5; ++k) still.push_back(camera_at({0.002 * k - 0.1, 0, 0}));
  const Map map = map_from(still);
  ASSERT_TRUE(locate(options_, other_, 5, *map.keyframe(1)->image).found);
  EXPECT_FALSE(tie_keyframe(options_, map, 1, other_, 5));
}

}  // namespace
}  // namespace mono_pose_tracker
