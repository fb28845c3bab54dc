#include "ros/camera_nodelet.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "../support/temporary_folder.h"

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

// JPEG files one after the other are a video.
TEST(Capture, AVideoThatChangesItsSizeBeginsAgainThere) {
  TemporaryFolder folder;
  std::string joined;
  const auto before = CodedSizes::frames_ahead() + 2;
  for (std::int64_t i = 0; i <= before; ++i) {
    std::vector<unsigned char> frame;
    const cv::Size size = i < before ? cv::Size(64, 48) : cv::Size(32, 24);
    cv::imencode(".jpg", cv::Mat(size, CV_8UC3, cv::Scalar::all(90)), frame);
    joined.append(frame.begin(), frame.end());
  }
  CaptureSettings settings;
  settings.video = folder.write("joined.mjpeg", joined);
  settings.loop = true;
  if (!cv::VideoCapture(settings.video, cv::CAP_FFMPEG).isOpened()) GTEST_SKIP() << "OpenCV without FFmpeg";
  Capture capture(settings);
  capture.open();
  cv::Mat image;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(capture.read(&image), Capture::Result::kImage);
    EXPECT_EQ(image.size(), cv::Size(64, 48));
    EXPECT_EQ(capture.take_note().empty(), i % 2 == 1 || i == 0) << i;
  }
}

}  // namespace
}  // namespace mono_pose_tracker
