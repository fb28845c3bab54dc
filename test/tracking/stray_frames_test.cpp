#include "tracking/stray_frames.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <vector>

#include "mono_pose_tracker/tracking/tracker.h"
#include "support/simulated_room.h"

namespace mono_pose_tracker {
namespace {

using Frames = std::set<std::int64_t>;

constexpr double kLeast = 0.05;
constexpr std::int64_t kPeriod_ns = 33333333;

// Forty frames, a centimetre apart.
std::vector<RegisteredFrame> walk() {
  std::vector<RegisteredFrame> frames;
  for (int i = 0; i < 40; ++i) {
    Rigid3 map_from_camera;
    map_from_camera.translation = Eigen::Vector3d(0.01 * i, 0, 0);
    frames.push_back({i, i * kPeriod_ns, map_from_camera});
  }
  return frames;
}

void move(std::vector<RegisteredFrame>* frames, int frame, double metres) {
  (*frames)[frame].map_from_camera.translation.z() += metres;
}

TEST(StrayFrames, AWalkHasNone) { EXPECT_EQ(stray_frames(walk(), kLeast), Frames()); }

TEST(StrayFrames, FramesFarFromThoseBesideThemAreFound) {
  std::vector<RegisteredFrame> frames = walk();
  move(&frames, 7, 1);
  move(&frames, 20, -0.5);
  move(&frames, 21, -0.4);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames({7, 20, 21}));
}

TEST(StrayFrames, ARunThatIsElsewhereForLessThanASecondIsFound) {
  std::vector<RegisteredFrame> frames = walk();
  Frames run;
  for (int i = 8; i < 32; ++i) run.insert(i), move(&frames, i, 3);
  EXPECT_EQ(stray_frames(frames, kLeast), run);
  // In two seconds the camera may have been taken there.
  frames = walk();
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].stamp_ns *= 3;
  for (int i = 8; i < 32; ++i) move(&frames, i, 3);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

// Half a metre, a second, and before and after it the camera stands.
TEST(StrayFrames, AHandThatReachesOutAndBackIsNotAstray) {
  std::vector<RegisteredFrame> frames = walk();
  for (RegisteredFrame& frame : frames) frame.map_from_camera.translation.x() *= 1e-3;
  for (int i = 10; i <= 30; ++i) move(&frames, i, 0.5 * std::sin(0.05 * 3.1416 * (i - 10)));
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

// A step, a stop and a new place are what cameras do.
TEST(StrayFrames, WhatDoesNotComeBackIsNotAstray) {
  std::vector<RegisteredFrame> frames = walk();
  for (int i = 15; i < 40; ++i) move(&frames, i, 2);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

// While the frames between are missing it had the time to go there and back.
TEST(StrayFrames, TimeExcusesALongWay) {
  std::vector<RegisteredFrame> frames = walk();
  move(&frames, 20, 0.3);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames({20}));
  frames.erase(frames.begin() + 21, frames.begin() + 25);
  frames.erase(frames.begin() + 16, frames.begin() + 20);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

TEST(StrayFrames, NoiseOfACameraThatStandsIsNoMotion) {
  std::vector<RegisteredFrame> frames = walk();
  for (RegisteredFrame& frame : frames) frame.map_from_camera.translation.x() *= 1e-3;
  move(&frames, 20, 0.8 * kLeast);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

TEST(StrayFrames, AFewFramesTellNoSpeed) {
  std::vector<RegisteredFrame> frames = walk();
  frames.resize(5);
  move(&frames, 2, 1);
  EXPECT_EQ(stray_frames(frames, kLeast), Frames());
}

class TrackedRoom : public ::testing::Test {
 protected:
  static constexpr int kFrames = 25, kStray = 6;

  TrackedRoom() : room_(simulated_room(kFrames, 1)), tracker_({}, room_.camera, Tracker::Mapping::kInline) {
    for (const SimulatedFrame& frame : room_.frames) tracker_.process(frame.stamp_ns, frame.image);
    EXPECT_TRUE(tracker_.finish());
  }

  // The pose of image `seen` at the time of kStray.
  void pose_stray(int seen) {
    const FrameReport report =
        tracker_.resect_again(kStray, room_.frames[kStray].stamp_ns, room_.frames[seen].image);
    ASSERT_TRUE(report.map_from_camera);
  }

  bool is_posed() const {
    for (const RegisteredFrame& frame : tracker_.trajectory()) {
      if (frame.index == kStray) return true;
    }
    return false;
  }

  const SimulatedRoom room_;
  Tracker tracker_;
};

TEST_F(TrackedRoom, AStrayIsPosedAgainWithoutItsKeyframe) {
  EXPECT_EQ(tracker_.take_out_strays(), Frames());
  pose_stray(kFrames - 1);
  EXPECT_EQ(tracker_.take_out_strays().count(kStray), 1u);
  tracker_.map().check();
  for (const auto& entry : tracker_.map().keyframes()) EXPECT_NE(entry.second.frame_index, kStray);
  pose_stray(kStray);
  tracker_.leave_out_strays();
  EXPECT_TRUE(is_posed());
}

TEST_F(TrackedRoom, WhatStaysAstrayHasNoPose) {
  pose_stray(kFrames - 1);
  tracker_.leave_out_strays();
  EXPECT_FALSE(is_posed());
}

TEST_F(TrackedRoom, WhatMovesAsItShouldIsLeftAlone) {
  const std::vector<RegisteredFrame> before = tracker_.trajectory();
  EXPECT_EQ(tracker_.settle_motion(), Frames());
  tracker_.smooth({kStray});  // it was not posed again
  const std::vector<RegisteredFrame> after = tracker_.trajectory();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i].map_from_camera.translation, before[i].map_from_camera.translation);
  }
}

TEST_F(TrackedRoom, AFrameThatMovesBeyondBeliefIsPosedAgain) {
  const auto center = [&](std::int64_t index) {
    for (const RegisteredFrame& frame : tracker_.trajectory()) {
      if (frame.index == index) return frame.map_from_camera.translation;
    }
    throw std::logic_error("not posed");
  };
  std::set<std::int64_t> keyframes;
  for (const auto& entry : tracker_.map().keyframes()) keyframes.insert(entry.second.frame_index);
  std::int64_t between = 3;
  while (keyframes.count(between)) ++between;
  ASSERT_LT(between, kFrames - 3);
  const Eigen::Vector3d was = center(between);
  const SimulatedFrame& frame = room_.frames[between];
  ASSERT_TRUE(
      tracker_.resect_again(between, frame.stamp_ns, room_.frames[kFrames - 1].image).map_from_camera);
  EXPECT_GT((center(between) - was).norm(), 0.1);
  const Frames unsettled = tracker_.settle_motion();
  EXPECT_EQ(unsettled.count(between), 1u);
  for (const std::int64_t index : unsettled) EXPECT_EQ(keyframes.count(index), 0u);
  for (const std::int64_t index : unsettled)
    tracker_.resect_again(index, room_.frames[index].stamp_ns, room_.frames[index].image);
  tracker_.smooth(unsettled);
  EXPECT_LT((center(between) - was).norm(), 0.01);
}

}  // namespace
}  // namespace mono_pose_tracker
