#include "ros/camera_nodelet.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

TEST(Capture, StampsOfTheMonotonicClockGiveTheAge) { EXPECT_NEAR(age_of_stamp(100.0, 100.04), 0.04, 1e-9); }

// Some drivers stamp by the wall clock, some not at all.
TEST(Capture, StampsOfAnotherClockGiveNoAge) {
  EXPECT_EQ(age_of_stamp(0.0, 5000.0), 0);
  EXPECT_EQ(age_of_stamp(1.7e9, 5000.0), 0);
}

std::string problem_of(const CaptureSettings& settings) {
  Capture capture(settings);
  try {
    capture.open();
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(Capture, SaysWhichDeviceIsMissing) {
  CaptureSettings settings;
  settings.device = "99";
  EXPECT_NE(problem_of(settings).find("no such device: /dev/video99"), std::string::npos);
}

TEST(Capture, AStreamThatCannotBeOpenedNamesThePackageThatPublishesStreams) {
  CaptureSettings settings;
  settings.device = "no_such_protocol://127.0.0.1/stream";
  EXPECT_NE(problem_of(settings).find("video_stream_opencv"), std::string::npos) << problem_of(settings);
}

TEST(Capture, SaysWhichVideoIsMissing) {
  CaptureSettings settings;
  settings.video = "/no/such/video.avi";
  EXPECT_NE(problem_of(settings).find("no such video: /no/such/video.avi"), std::string::npos);
}

}  // namespace
}  // namespace mono_pose_tracker
