#include "mono_pose_tracker/ros/debug_image.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {
namespace {

using Fate = SeenFeature::Fate;

const cv::Mat kGrey(480, 640, CV_8UC1, cv::Scalar(90));

// BGR, far from grey: which of the channels stands out.
char hue(const cv::Vec3b& p) {
  if (p[1] > p[0] + 60 && p[1] > p[2] + 60) return 'g';
  if (p[2] > p[0] + 60 && p[2] > p[1] + 60) return 'r';
  if (p[0] > p[2] + 60) return 'b';
  if (p[1] > p[0] + 60 && p[2] > p[0] + 60) return 'y';
  return '-';
}

char hue_at(const cv::Mat& image, int x, int y) { return hue(image.at<cv::Vec3b>(y, x)); }

FrameReport tracked() {
  FrameReport report;
  report.state = State::kTracking;
  report.map_from_camera = Rigid3();
  return report;
}

TEST(DebugImage, FeaturesAreDrawnByWhatBecameOfThem) {
  FrameReport report = tracked();
  report.seen = {
      {{100, 300}, Fate::kInlier, 1}, {{200, 300}, Fate::kOutlier, -1}, {{300, 300}, Fate::kUnmatched, -1}};
  const cv::Mat drawn = DebugImage().draw(kGrey, report);
  EXPECT_EQ(drawn.type(), CV_8UC3);
  EXPECT_EQ(hue_at(drawn, 100, 300), 'g');
  EXPECT_EQ(hue_at(drawn, 200, 300), 'r');
  EXPECT_EQ(hue_at(drawn, 300, 300), 'b');
  EXPECT_EQ(hue_at(drawn, 400, 300), '-');
}

TEST(DebugImage, InliersTrailTheirTracks) {
  DebugImage debug;
  FrameReport report = tracked();
  report.seen = {{{100, 300}, Fate::kInlier, 7}};
  debug.draw(kGrey, report);
  report.seen = {{{140, 300}, Fate::kInlier, 7}};
  EXPECT_EQ(hue_at(debug.draw(kGrey, report), 120, 300), 'g');
  // Another map's landmark of the same number is another landmark.
  ++report.epoch;
  report.seen = {{{180, 300}, Fate::kInlier, 7}};
  EXPECT_EQ(hue_at(debug.draw(kGrey, report), 160, 300), '-');
}

TEST(DebugImage, TheMotionSinceTheReferenceIsDrawnWhileThereIsNoMap) {
  FrameReport report;
  report.motions = {{{100, 300}, {160, 300}}};
  EXPECT_EQ(hue_at(DebugImage().draw(kGrey, report), 130, 300), 'y');
}

TEST(DebugImage, WordsStayInTheImage) {
  FrameReport report;
  report.reason = Reason::kLowParallax;
  report.reason_text =
      "too little parallax: the image moved by 1.2 px since the reference, 3.0 needed, and so on and on";
  const cv::Mat small(120, 160, CV_8UC1, cv::Scalar(90));
  const cv::Mat drawn = DebugImage().draw(small, report);
  EXPECT_EQ(drawn.size(), small.size());
  cv::Mat grey;
  cv::cvtColor(drawn, grey, cv::COLOR_BGR2GRAY);
  double brightest = 0;
  cv::minMaxLoc(grey.rowRange(0, 60), nullptr, &brightest);
  EXPECT_GT(brightest, 150) << "words";
  cv::minMaxLoc(grey.colRange(156, 160), nullptr, &brightest);
  EXPECT_LT(brightest, 100) << "none runs over the edge";
}

// Whatever keeps the tracker waiting, the image says what would help.
TEST(DebugImage, EveryReasonToWaitHasAdvice) {
  for (const Reason reason :
       {Reason::kNoCameraInfo, Reason::kUncalibrated, Reason::kImageSizeMismatch, Reason::kTooFewFeatures,
        Reason::kTooFewMatches, Reason::kLowParallax, Reason::kRotationOnly, Reason::kAmbiguousPose,
        Reason::kTooFewInliers, Reason::kFirstFrame, Reason::kAwaitingConfirmation, Reason::kPaused}) {
    EXPECT_STRNE(what_to_do(reason), "") << to_string(reason);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
