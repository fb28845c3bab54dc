#include "map/frame_poses.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

FramePose on(KeyframeId reference) {
  FramePose pose;
  pose.reference = reference;
  pose.camera_from_reference.translation = {1, 0, 0};
  return pose;
}

std::vector<std::int64_t> indices(const FramePoses& poses) {
  std::vector<std::int64_t> result;
  for (const auto& entry : poses.all()) result.push_back(entry.first);
  return result;
}

TEST(FramePoses, AreByIndexInWhateverOrderTheyCome) {
  FramePoses poses;
  for (const std::int64_t index : {5, 9, 7, 2, 8}) poses.set(index, on(0));
  poses.set(7, on(3));
  EXPECT_EQ(indices(poses), (std::vector<std::int64_t>{2, 5, 7, 8, 9}));
  ASSERT_TRUE(poses.find(7));
  EXPECT_EQ(poses.find(7)->reference, 3) << "set again";
  EXPECT_FALSE(poses.find(6));
  EXPECT_FALSE(poses.find(10));
}

TEST(FramePoses, TheOldestAreForgotten) {
  FramePoses poses;
  for (int i = 0; i < 10; ++i) poses.set(i, on(0));
  poses.keep_newest(3);
  EXPECT_EQ(indices(poses), (std::vector<std::int64_t>{7, 8, 9}));
}

TEST(FramePoses, OfAFrameInBothMapsTheOwnPoseStays) {
  FramePoses own, other;
  for (const int i : {0, 1, 6}) own.set(i, on(1));
  for (const int i : {1, 3, 8}) other.set(i, on(2));
  own.take(other);
  EXPECT_EQ(indices(own), (std::vector<std::int64_t>{0, 1, 3, 6, 8}));
  EXPECT_EQ(own.find(1)->reference, 1);
  EXPECT_EQ(own.find(3)->reference, 2);
}

// Two maps are joined: the ids of one go on from the last of the other.
TEST(FramePoses, LandmarksKeepTheirNamesWhenMapsAreJoined) {
  FramePoses poses;
  FramePose pose = on(2);
  pose.landmarks =
      std::make_shared<std::vector<LandmarkPixel>>(std::vector<LandmarkPixel>{{3, {10, 20}}, {7, {30, 40}}});
  poses.set(1, pose);
  poses.set(2, on(2));
  MapCorrection correction;
  correction.added = {100, 1000};
  poses.apply(correction);
  const RegisteredLandmarks registered = poses.landmarks();
  ASSERT_EQ(registered.size(), 1u) << "of the frames where it was kept";
  const std::vector<LandmarkPixel>& seen = *registered.at(1);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].landmark, 1003);
  EXPECT_EQ(seen[1].landmark, 1007);
  EXPECT_EQ(seen[1].pixel, Eigen::Vector2f(30, 40));
  EXPECT_EQ((*pose.landmarks)[0].landmark, 3) << "a copy may be shared";
}

TEST(FramePoses, APoseInAnotherGeometryIsStaleUntilItIsEstimatedAgain) {
  FramePoses poses;
  poses.set(0, on(1));
  MapCorrection correction;
  poses.apply(correction);
  EXPECT_FALSE(poses.find(0)->is_stale) << "lengths alone";
  correction.other_geometry = true;
  poses.apply(correction);
  EXPECT_TRUE(poses.find(0)->is_stale);
  poses.apply(MapCorrection());
  EXPECT_TRUE(poses.find(0)->is_stale) << "it holds no more for that";
  poses.set(0, on(1));
  EXPECT_FALSE(poses.find(0)->is_stale);
}

TEST(FramePoses, RideOnKeyframesOfACorrectedMap) {
  FramePoses poses;
  poses.set(0, on(1));
  poses.set(1, on(2));
  MapCorrection correction;
  correction.added.keyframes = 10;
  correction.scale = 2;
  correction.scale_of[12] = 3;  // by the id after it
  poses.apply(correction);
  EXPECT_EQ(poses.find(0)->reference, 11);
  EXPECT_DOUBLE_EQ(poses.find(0)->camera_from_reference.translation.x(), 2);
  EXPECT_EQ(poses.find(1)->reference, 12);
  EXPECT_DOUBLE_EQ(poses.find(1)->camera_from_reference.translation.x(), 3);
}

}  // namespace
}  // namespace mono_pose_tracker
