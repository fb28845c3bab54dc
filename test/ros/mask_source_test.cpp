#include "ros/live_tracker.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>
#include <future>

namespace mono_pose_tracker {
namespace {

using std::chrono::milliseconds;

// Much more than a busy machine needs; only a failure takes so long.
constexpr milliseconds kLong{60000};

sensor_msgs::ImageConstPtr mask_at(double seconds) {
  auto mask = boost::make_shared<sensor_msgs::Image>();
  mask->header.stamp = ros::Time(seconds);
  return mask;
}

TEST(MaskSource, GivesTheMaskOfTheImagesStamp) {
  MaskSource masks;
  const auto first = mask_at(1), second = mask_at(2);
  masks.put(first);
  masks.put(second);
  EXPECT_EQ(masks.wait(ros::Time(2), kLong), second);
  EXPECT_EQ(masks.wait(ros::Time(1), kLong), first);
}

TEST(MaskSource, WithoutOneTheWaitEnds) {
  MaskSource masks;
  masks.put(mask_at(1));
  EXPECT_EQ(masks.wait(ros::Time(1.000000001), milliseconds(0)), nullptr)
      << "a stamp is equal or it is another";
  const auto before = std::chrono::steady_clock::now();
  EXPECT_EQ(masks.wait(ros::Time(2), milliseconds(20)), nullptr);
  EXPECT_GE(std::chrono::steady_clock::now() - before, milliseconds(20));
}

TEST(MaskSource, TheImageWaitsForItsMask) {
  MaskSource masks;
  auto waiting = std::async(std::launch::async, [&] { return masks.wait(ros::Time(2), kLong); });
  masks.put(mask_at(1));  // not the one
  const auto mask = mask_at(2);
  masks.put(mask);
  EXPECT_EQ(waiting.get(), mask);
}

// Whatever ~mask_timeout is, who ends the node does not wait so long.
TEST(MaskSource, CancelledNobodyWaits) {
  MaskSource masks;
  auto waiting = std::async(std::launch::async, [&] { return masks.wait(ros::Time(2), kLong); });
  const auto before = std::chrono::steady_clock::now();
  masks.cancel();
  EXPECT_EQ(waiting.get(), nullptr);
  EXPECT_EQ(masks.wait(ros::Time(3), kLong), nullptr);
  EXPECT_LT(std::chrono::steady_clock::now() - before, kLong);
}

// Whoever publishes masks without end for images that never come must not fill the memory.
TEST(MaskSource, OldMasksGo) {
  MaskSource masks;
  for (int i = 1; i <= 1000; ++i) masks.put(mask_at(i));
  EXPECT_EQ(masks.wait(ros::Time(1), milliseconds(0)), nullptr);
  EXPECT_NE(masks.wait(ros::Time(1000), milliseconds(0)), nullptr);
  int kept = 0;
  for (int i = 1; i <= 1000; ++i) kept += masks.wait(ros::Time(i), milliseconds(0)) != nullptr;
  EXPECT_LE(kept, 30);
  EXPECT_GE(kept, 5) << "a segmentation may be some images ahead";
}

}  // namespace
}  // namespace mono_pose_tracker
