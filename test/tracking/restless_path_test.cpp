#include "mono_pose_tracker/tracking/restless_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace mono_pose_tracker {
namespace {

// A camera that goes forward by a tenth from image to image, and where else it is put.
RestlessPath path(const std::function<double(int)>& aside) {
  std::vector<PosedFrame> frames;
  for (int i = 0; i < 100; ++i) {
    frames.push_back({i, i * std::int64_t{33'000'000},
                      Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(aside(i), 0, 0.1 * i))});
  }
  return most_restless_stretch(frames, 0.02, {});
}

TEST(RestlessPath, APartBesideItsPlaceIsReachedByALeap) {
  const auto leap = [](double aside) {
    std::vector<PosedFrame> frames;
    for (int i = 0; i < 100; ++i) {
      const double x = 0.02 * (i % 3) + (i >= 40 && i < 60 ? aside : 0);
      // Back again beyond a gap.
      if (i < 60 || i > 65)
        frames.push_back({i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0.1 * i))});
    }
    return greatest_leap(frames);
  };
  EXPECT_LT(leap(0), 2);
  EXPECT_GT(leap(0.6), 8);
  EXPECT_EQ(greatest_leap({}), 0);
}

TEST(RestlessPath, AWalkHasNone) {
  EXPECT_EQ(path([](int) { return 0; }).jumps, 0);
}

TEST(RestlessPath, TurningBackIsNoJump) {
  EXPECT_EQ(path([](int i) { return i % 2 == 0 ? 0 : 0.1; }).jumps, 0);
}

// Every third image is taken for one a door farther on.
TEST(RestlessPath, DoorsThatAreTakenForEachOtherAreFound) {
  const RestlessPath found = path([](int i) { return i >= 40 && i < 70 && i % 3 == 0 ? 1 : 0; });
  EXPECT_TRUE(found.is_significant());
  EXPECT_GE(found.frame_index, 35);
  EXPECT_LT(found.frame_index, 70);
}

TEST(RestlessPath, OneImageThatIsAstrayIsNotEnough) {
  const RestlessPath found = path([](int i) { return i == 50 ? 1 : 0; });
  EXPECT_EQ(found.jumps, 3);
  EXPECT_FALSE(found.is_significant());
}

// Still for the most part, then twice as far to either side as would be a jump, eight images each time.
TEST(RestlessPath, AHeadThatIsShakenDoesNotJump) {
  std::vector<PosedFrame> frames;
  for (int i = 0; i < 100; ++i) {
    const double aside = i < 60 ? 0.001 * (i % 3) : std::sin(2 * M_PI * (i - 60) / 8);
    frames.push_back({i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(aside, 0, 0))});
  }
  EXPECT_FALSE(most_restless_stretch(frames, 0.02, {}).is_significant());
}

// A head that is shaken faster than that: the images themselves show it.
TEST(RestlessPath, WhatTheImagesShowIsNoJump) {
  std::vector<PosedFrame> frames;
  SeenSteps seen;
  for (int i = 0; i < 100; ++i) {
    const double aside = i < 60 ? 0.001 * (i % 3) : i % 2;
    frames.push_back({i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(aside, 0, 0))});
  }
  EXPECT_TRUE(most_restless_stretch(frames, 0.02, seen).is_significant());
  const std::set<std::int64_t> at_jumps = frames_at_jumps(frames, 0.02);
  EXPECT_EQ(at_jumps.count(50), 0u);
  for (int i = 61; i < 99; ++i) EXPECT_EQ(at_jumps.count(i), 1u) << i;
  for (int i = 60; i < 90; ++i) seen[i] = true;
  EXPECT_TRUE(most_restless_stretch(frames, 0.02, seen).is_significant()) << "the last ten are not";
  for (int i = 90; i < 100; ++i) seen[i] = true;
  EXPECT_FALSE(most_restless_stretch(frames, 0.02, seen).is_significant());
  for (int i = 60; i < 100; i += 2) seen[i] = false;
  EXPECT_FALSE(most_restless_stretch(frames, 0.02, seen).is_significant()) << "each other step is shown";
  for (int i = 60; i < 100; ++i) seen[i] = false;
  EXPECT_TRUE(most_restless_stretch(frames, 0.02, seen).is_significant()) << "none is";
}

// As a film of 15 images a second is in a video of 30, or of 10 in one of 30.
TEST(RestlessPath, ImagesThatComeTwiceOrThriceAreNoJumps) {
  for (const int times : {2, 3}) {
    std::vector<PosedFrame> frames;
    for (int i = 0; i < 90; ++i) {
      const double noise = 1e-4 * (i % 7);
      frames.push_back(
          {i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(noise, 0, 0.1 * (i / times)))});
    }
    EXPECT_EQ(most_restless_stretch(frames, 0.02, {}).jumps, 0) << times;
  }
}

// A camera that goes on by less than what counts as a jump, or stands: the jumps are no steps of its own.
TEST(RestlessPath, ASlowCameraThatJumpsIsFound) {
  for (const double step : {0.01, 0.0}) {
    std::vector<PosedFrame> frames;
    for (int i = 0; i < 100; ++i) {
      const double aside = i % 5 == 0 ? 1 : 0;
      frames.push_back({i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(aside, 0, step * i))});
    }
    EXPECT_TRUE(most_restless_stretch(frames, 0.02, {}).is_significant()) << step;
  }
}

TEST(RestlessPath, WhatHardlyMovesJumpsByNoise) {
  std::vector<PosedFrame> frames;
  for (int i = 0; i < 60; ++i) {
    const double noise = i % 5 == 0 ? 0.01 : 0;
    frames.push_back({i, i, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(noise, 0, 0))});
  }
  EXPECT_EQ(most_restless_stretch(frames, 0.05, {}).jumps, 0);
}

}  // namespace
}  // namespace mono_pose_tracker
