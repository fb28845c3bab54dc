#include "mapping/motion_prior.h"

#include <gtest/gtest.h>
#include <cmath>
#include <random>
#include <vector>

namespace mono_pose_tracker {
namespace {

// A hand-held camera on a line, ten keyframes a second: steps of 1 with jitter of 0.1.
std::vector<Eigen::Vector3d> walk(int count) {
  std::mt19937 random(1);
  std::normal_distribution<double> jitter(0, 0.1);
  std::vector<Eigen::Vector3d> positions;
  for (int k = 0; k < count; ++k) positions.emplace_back(k + jitter(random), jitter(random), jitter(random));
  return positions;
}

std::set<KeyframeId> off_motion_of(const std::vector<Eigen::Vector3d>& positions,
                                   const std::vector<std::int64_t>& stamps_ms = {}) {
  std::vector<Keyframe> keyframes(positions.size());
  for (std::size_t k = 0; k < positions.size(); ++k) {
    keyframes[k].id = static_cast<KeyframeId>(k);
    keyframes[k].frame_index = static_cast<std::int64_t>(k);
    keyframes[k].stamp_ns = 1000000 * (stamps_ms.empty() ? 100 * static_cast<std::int64_t>(k) : stamps_ms[k]);
    keyframes[k].camera_from_map.translation = -positions[k];
    keyframes[k].image = std::make_shared<ImageFeatures>();
  }
  return off_motion(Map::restore(keyframes, {}, {}, ScaleSource::kMapUnits));
}

TEST(OffMotion, OneKeyframeOrTwoInARowFarFromTheMotionOfTheOthers) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  EXPECT_TRUE(off_motion_of(positions).empty());
  positions[20].y() += 5;
  EXPECT_EQ(off_motion_of(positions), (std::set<KeyframeId>{20}));
  positions[21].y() += 4;
  EXPECT_EQ(off_motion_of(positions), (std::set<KeyframeId>{20, 21}));
}

TEST(OffMotion, NotTheBeginningOfAnotherPlace) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  for (int k = 20; k < 40; ++k) positions[k].y() += 50;
  EXPECT_TRUE(off_motion_of(positions).empty());
}

TEST(OffMotion, NotWhatIsWithinThePrecisionOfAKnownPath) {
  std::vector<Eigen::Vector3d> positions = walk(400);  // 3 % of the path are 12
  positions[200].y() += 10;
  EXPECT_TRUE(off_motion_of(positions).empty());
}

// A walk of which 3 s are missing: the camera has come 30 units farther in them.
TEST(OffMotion, NotAfterAGapInTime) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  std::vector<std::int64_t> stamps_ms;
  for (int k = 0; k < 40; ++k) {
    stamps_ms.push_back(100 * k + (k < 20 ? 0 : 3000) + (k < 21 ? 0 : 3000));
    positions[k].x() += (k < 20 ? 0 : 30) + (k < 21 ? 0 : 30);
  }
  EXPECT_TRUE(off_motion_of(positions, stamps_ms).empty());
}

// The camera turns twice by 90 degrees, two keyframes apart, and stops for two intervals.
TEST(OffMotion, NotCornersAndStops) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  for (int k = 21; k < 40; ++k) positions[k] += Eigen::Vector3d(-std::min(2, k - 20), std::min(2, k - 20), 0);
  EXPECT_TRUE(off_motion_of(positions).empty());
  for (int k = 31; k < 40; ++k) positions[k].x() -= std::min(2, k - 30);
  EXPECT_TRUE(off_motion_of(positions).empty());
}

// Three views confirm each other; the tests of whole segments are for these.
TEST(OffMotion, NotThreeInARow) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  for (int k = 14; k < 17; ++k) positions[k].y() += 5;
  EXPECT_TRUE(off_motion_of(positions).empty());
}

TEST(OffMotion, NotARightKeyframeBetweenWrongOnes) {
  std::vector<Eigen::Vector3d> positions = walk(40);
  positions[14].y() += 5;
  positions[16].y() += 5;
  EXPECT_EQ(off_motion_of(positions).count(15), 0U);
}

TEST(OffMotion, NothingOfAFewKeyframes) {
  std::vector<Eigen::Vector3d> positions = walk(8);
  positions[4].y() += 5;
  EXPECT_TRUE(off_motion_of(positions).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
