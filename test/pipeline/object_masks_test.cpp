#include "pipeline/object_masks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace mono_pose_tracker {
namespace {

const cv::Size kSize(320, 240);

// Features on a grid of 10 px: the other object's in a disc of 45 px that moves 40 px to the right between
// the images 4 and 8, the mapped object's around it.
std::vector<MotionTrack> disc_before_wall() {
  std::vector<MotionTrack> tracks;
  for (int y = 5; y < kSize.height; y += 10) {
    for (int x = 5; x < kSize.width; x += 10) {
      const Eigen::Vector2f from(static_cast<float>(x), static_cast<float>(y));
      const bool is_other = std::hypot(x - 120, y - 120) < 45;
      const bool is_hidden = !is_other && std::hypot(x - 160, y - 120) < 45;  // in the second image
      if (is_hidden) continue;
      tracks.push_back({4, 8, from, from + Eigen::Vector2f(is_other ? 40 : 0, 0), is_other});
    }
  }
  return tracks;
}

double overlap(const cv::Mat& mask, const cv::Point& middle, double radius) {
  int both = 0, either = 0;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const bool is_in = mask.at<std::uint8_t>(y, x) != 0;
      const bool is_disc = std::hypot(x - middle.x, y - middle.y) < radius;
      both += is_in && is_disc;
      either += is_in || is_disc;
    }
  }
  return static_cast<double>(both) / either;
}

TEST(ObjectMasks, GoWithTheObject) {
  const ObjectMasks masks(disc_before_wall(), nullptr);
  ASSERT_FALSE(masks.are_empty());
  EXPECT_GT(overlap(masks.mask(4, kSize), {120, 120}, 45), 0.7);
  EXPECT_GT(overlap(masks.mask(6, kSize), {140, 120}, 45), 0.7);
  EXPECT_EQ(cv::norm(masks.mask(0, kSize), masks.mask(4, kSize)), 0) << "before the first it is where it was";
  EXPECT_EQ(cv::norm(masks.mask(99, kSize), masks.mask(8, kSize)), 0);
}

TEST(ObjectMasks, OneWrongMatchIsOutvoted) {
  std::vector<MotionTrack> tracks = disc_before_wall();
  const auto far = std::find_if(tracks.begin(), tracks.end(), [](const auto& t) { return t.from.x() > 280; });
  far->is_other = true;
  EXPECT_EQ(
      ObjectMasks(tracks, nullptr).mask(4, kSize).at<std::uint8_t>(cv::Point(far->from.x(), far->from.y())),
      0);
}

TEST(ObjectMasks, ArePartsOfThoseTheyAreWithin) {
  std::vector<MotionTrack> left = disc_before_wall();
  for (MotionTrack& track : left) track.is_other = track.from.x() < 120;
  const auto within = std::make_shared<ObjectMasks>(left, nullptr);
  const cv::Mat mask = ObjectMasks(disc_before_wall(), within).mask(4, kSize);
  EXPECT_GT(mask.at<std::uint8_t>(120, 100), 0);
  EXPECT_EQ(cv::countNonZero(mask.colRange(125, kSize.width)), 0);
}

TEST(ObjectMasks, AHandfulOfFeaturesIsNoObject) {
  std::vector<MotionTrack> tracks = disc_before_wall();
  int others = 0;
  for (MotionTrack& track : tracks) track.is_other = track.is_other && ++others <= 5;
  EXPECT_TRUE(ObjectMasks(tracks, nullptr).are_empty());
}

}  // namespace
}  // namespace mono_pose_tracker
