#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "ros/debug_image.h"
#include "support/synthetic_views.h"
#include "tracking/load_governor.h"

namespace mono_pose_tracker {
namespace {

TEST(ObjectAxes, AreWhereTheCameraSeesThem) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  const auto axes = project_axes(plain_camera(), Rigid3(quarter, {0.1, 0.2, 2}), 0.4);
  ASSERT_TRUE(axes);
  EXPECT_NEAR((axes->origin_px - Eigen::Vector2d(345, 290)).norm(), 0, 1e-9);
  EXPECT_NEAR((axes->tips_px[0] - Eigen::Vector2d(345, 390)).norm(), 0, 1e-9) << "x points down";
  EXPECT_NEAR((axes->tips_px[1] - Eigen::Vector2d(245, 290)).norm(), 0, 1e-9) << "y to the left";
  EXPECT_NEAR((axes->tips_px[2] - Eigen::Vector2d(320 + 50 / 2.4, 240 + 100 / 2.4)).norm(), 0, 1e-9)
      << "z away from the camera";
}

TEST(ObjectAxes, AreNotSeenBehindTheCamera) {
  EXPECT_FALSE(project_axes(plain_camera(), Rigid3(Eigen::Quaterniond::Identity(), {0, 0, -1}), 0.4));
  const Eigen::Quaterniond towards(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(project_axes(plain_camera(), Rigid3(towards, {0, 0, 0.3}), 0.4)) << "z reaches past it";
}

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

TEST(DebugImage, WithoutTimeForMoreOneIsDrawnASecond) {
  DebugImage debug;
  FrameReport report = tracked();
  int drawn = 0;
  const auto draw_for_three_seconds = [&] {
    drawn = 0;
    for (int i = 0; i < 90; ++i) {
      report.stamp_ns += 1'000'000'000 / 30;
      if (!debug.is_due(report)) continue;
      debug.draw(kGrey, report);
      ++drawn;
    }
  };
  draw_for_three_seconds();
  EXPECT_EQ(drawn, 90);
  report.load_level = kLittleDrawn;
  draw_for_three_seconds();
  EXPECT_GE(drawn, 2);
  EXPECT_LE(drawn, 3);
  report.stamp_ns = 5;  // a bag begins anew
  EXPECT_TRUE(debug.is_due(report));
}

TEST(DebugImage, ThatItIsDrawnOnceASecondIsSaidAndNothingTrails) {
  DebugImage debug;
  FrameReport report = tracked();
  report.seen = {{{100, 300}, Fate::kInlier, 7}};
  const cv::Mat usual = debug.draw(kGrey, report);
  report.load_level = kLittleDrawn;
  report.seen = {{{140, 300}, Fate::kInlier, 7}};
  const cv::Mat busy = debug.draw(kGrey, report);
  EXPECT_EQ(hue_at(busy, 120, 300), '-') << "where it was a second ago is no tail";
  int yellow = 0;
  for (int y = 0; y < 150; ++y) {
    for (int x = 0; x < busy.cols; ++x) yellow += hue_at(busy, x, y) == 'y' && hue_at(usual, x, y) != 'y';
  }
  EXPECT_GT(yellow, 50) << "words";
}

TEST(DebugImage, TheMotionSinceTheReferenceIsDrawnWhileThereIsNoMap) {
  FrameReport report;
  report.motions = {{{100, 300}, {160, 300}}};
  EXPECT_EQ(hue_at(DebugImage().draw(kGrey, report), 130, 300), 'y');
}

ObjectAxes axes_in_the_middle() {
  return {{320, 300}, {Eigen::Vector2d(420, 300), Eigen::Vector2d(320, 400), Eigen::Vector2d(250, 230)}};
}

TEST(DebugImage, TheAxesOfAnObjectAreDrawn) {
  const cv::Mat drawn = DebugImage().draw(kGrey, tracked(), axes_in_the_middle());
  EXPECT_EQ(hue_at(drawn, 370, 300), 'r') << "x";
  EXPECT_EQ(hue_at(drawn, 320, 350), 'g') << "y";
  EXPECT_EQ(hue_at(drawn, 285, 265), 'b') << "z";
  EXPECT_EQ(hue_at(drawn, 270, 350), '-');
  const cv::Mat without = DebugImage().draw(kGrey, tracked());
  for (const auto& [x, y] : {std::pair(370, 300), std::pair(320, 350), std::pair(285, 265)}) {
    EXPECT_EQ(hue_at(without, x, y), '-') << "a map that is no object has none";
  }
}

TEST(DebugImage, AnObjectHasItsMasksOutline) {
  FrameReport report = tracked();
  report.seen = {
      {{210, 300}, Fate::kInlier, 1}, {{390, 210}, Fate::kInlier, 2}, {{390, 390}, Fate::kInlier, 3}};
  report.mask = cv::Mat::zeros(kGrey.size(), CV_8UC1);
  report.mask(cv::Rect(200, 200, 200, 200)) = 255;
  const cv::Mat drawn = DebugImage().draw(kGrey, report, axes_in_the_middle());
  EXPECT_EQ(hue_at(drawn, 200, 260), 'b');
  EXPECT_EQ(hue_at(drawn, 300, 200), 'b');
  EXPECT_EQ(hue_at(drawn, 390, 260), '-') << "no hull beside it";
  EXPECT_LT(drawn.at<cv::Vec3b>(300, 100)[0], 60) << "what is not the object is dimmed";
}

TEST(DebugImage, AnObjectWithoutAMaskHasAnOutlineRoundItsInliers) {
  FrameReport report = tracked();
  report.seen = {{{200, 200}, Fate::kInlier, 1},    {{500, 200}, Fate::kInlier, 2},
                 {{500, 400}, Fate::kInlier, 3},    {{200, 400}, Fate::kInlier, 4},
                 {{240, 260}, Fate::kInlier, 5},    {{600, 300}, Fate::kOutlier, -1},
                 {{100, 300}, Fate::kUnmatched, -1}};
  const cv::Mat drawn = DebugImage().draw(kGrey, report, axes_in_the_middle());
  EXPECT_EQ(hue_at(drawn, 450, 200), 'b');
  EXPECT_EQ(hue_at(drawn, 500, 300), 'b');
  EXPECT_EQ(hue_at(drawn, 220, 230), '-') << "only round all of them";
  EXPECT_EQ(hue_at(drawn, 550, 300), '-') << "what does not fit the pose is not the object's";
  EXPECT_EQ(hue_at(DebugImage().draw(kGrey, report), 450, 200), '-');
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

TEST(DebugImage, WordsLeaveThreeQuartersOfAWideImage) {
  const cv::Mat wide(376, 1241, CV_8UC1, cv::Scalar(90));
  const cv::Mat drawn = DebugImage().draw(wide, tracked());
  const int words_end = 376 / 4 + 6;  // px, with the margin
  for (const int y : {words_end + 1, 180, 300}) EXPECT_EQ(drawn.at<cv::Vec3b>(y, 1200)[0], 90) << y;
  EXPECT_LT(drawn.at<cv::Vec3b>(10, 1200)[0], 60) << "a dark band behind them";
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
