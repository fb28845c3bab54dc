#include "ros/live_tracker.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

/// A keyframe that sees these landmarks.
KeyframeView keyframe(KeyframeId id, const std::vector<LandmarkId>& landmarks) {
  KeyframeView view;
  view.id = id;
  view.stamp_ns = 1000 + id;
  auto image = std::make_shared<ImageFeatures>();
  image->color_rgb.assign(landmarks.size(), cv::Vec3b(10, 20, 30));
  view.image = image;
  view.landmark_of_feature = landmarks;
  return view;
}

TEST(DrawnMap, IsCopiedOnceAndWhenItIsAskedFor) {
  auto map = std::make_shared<TrackingMap>();
  map->epoch = 3;
  for (int i = 0; i < 5; ++i) map->landmarks.set(i, Eigen::Vector3d(i, 0, 1));
  map->keyframes.set(0, keyframe(0, {0, 1, 2, -1}));
  map->keyframes.set(1, keyframe(1, {2, 3, 7}));  // 7 is no more
  const DrawnMap drawn(map);
  EXPECT_TRUE(drawn.has_points());
  EXPECT_EQ(drawn.newest().epoch, 3u);
  ASSERT_EQ(drawn.newest().keyframes.size(), 1u);
  EXPECT_EQ(drawn.newest().keyframes[0].stamp_ns, 1001);
  EXPECT_EQ(drawn.newest().points.size(), 2u);
  EXPECT_FALSE(drawn.is_copied()) << "the whole map, for nobody";
  const MapSnapshot& all = drawn.all();
  EXPECT_EQ(all.points.size(), 4u);
  EXPECT_EQ(all.keyframes.size(), 2u);
  EXPECT_TRUE(drawn.is_copied());
  EXPECT_EQ(&drawn.all(), &all);
}

TEST(DrawnMap, MayBeNone) {
  const DrawnMap none(nullptr);
  EXPECT_FALSE(none.has_points());
  EXPECT_TRUE(none.newest().keyframes.empty());
  EXPECT_TRUE(none.all().points.empty());
}

}  // namespace
}  // namespace mono_pose_tracker
