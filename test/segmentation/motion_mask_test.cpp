#include "segmentation/motion_mask.h"

#include <gtest/gtest.h>

#include "segmentation/object_images.h"

namespace mono_pose_tracker {
namespace {

const cv::Size kSize(640, 480);
constexpr int kBefore = 4;     // images until the motion is known
constexpr double kStepPx = 3;  // of the object, an image

// An object with texture of its own that slides over a background; the camera may be jolted.
class Stage {
 public:
  ObjectImage image(int frame, const cv::Point& jolt = {}) const {
    ObjectImage image{wide_background_(cv::Rect(cv::Point(40, 40) + jolt, kSize)).clone(),
                      cv::Mat::zeros(kSize, CV_8UC1)};
    cv::ellipse(image.object, centre(frame), {100, 140}, 0, 0, 360, 255, cv::FILLED);
    const cv::Point shift(static_cast<int>(kStepPx) * frame, 0);
    wide_object_(cv::Rect(cv::Point(150, 40) - shift, kSize)).copyTo(image.bgr, image.object);
    add_noise(2, 900 + frame, &image.bgr);
    return image;
  }
  // Points spread over the object, and over the rest.
  std::vector<cv::Point2f> points(int frame, bool of_object) const {
    const cv::Mat object = image(frame).object;
    std::vector<cv::Point2f> points;
    for (int y = 10; y < kSize.height; y += 20) {
      for (int x = 10; x < kSize.width; x += 20) {
        if ((object.at<std::uint8_t>(y, x) != 0) == of_object) points.emplace_back(x, y);
      }
    }
    return points;
  }

 private:
  static cv::Point centre(int frame) { return {220 + static_cast<int>(kStepPx) * frame, 240}; }

  cv::Mat wide_background_ = texture({720, 560}, 1), wide_object_ = texture({800, 560}, 2);
};

SegmentationOptions motion_options() {
  SegmentationOptions options;
  options.method = "motion";
  return options;
}

void start(const Stage& stage, MotionMask* mask) {
  for (int i = 0; i <= kBefore; ++i) mask->watch(stage.image(i).bgr);
  mask->start(stage.points(kBefore, true), stage.points(kBefore, false), kBefore, kBefore * kStepPx);
}

void follow(const Stage& stage, int frame, MotionMask* mask) {
  mask->watch(stage.image(frame).bgr);
  mask->observe(stage.points(frame, true), kStepPx);
}

TEST(MotionMask, HasNoMaskUntilItIsStarted) {
  MotionMask mask(motion_options());
  mask.watch(Stage().image(0).bgr);
  EXPECT_FALSE(mask.is_started());
  EXPECT_TRUE(mask.mask().empty());
}

TEST(MotionMask, IsNotStartedBeforeItHasWatched) {
  MotionMask mask(motion_options());
  const Stage stage;
  mask.start(stage.points(0, true), stage.points(0, false), kBefore, kBefore * kStepPx);
  EXPECT_FALSE(mask.is_started());
  mask.watch(stage.image(0).bgr);
  EXPECT_TRUE(mask.mask().empty());
}

// Small images are worked on as they are, and their owners go on with them.
TEST(MotionMask, AnImageMayBeOverwrittenOnceItWasWatched) {
  const Stage stage;
  const auto mask_of_last = [&](bool overwritten) {
    MotionMask mask(motion_options());
    cv::Mat buffer;
    for (int i = 0; i <= kBefore; ++i) {
      const cv::Mat small = stage.image(i).bgr(cv::Rect(60, 60, 320, 320));
      small.copyTo(buffer);
      mask.watch(buffer);
      if (overwritten) buffer = cv::Scalar(0, 0, 0);
    }
    const auto inside = [](const std::vector<cv::Point2f>& points) {
      std::vector<cv::Point2f> result;
      for (const cv::Point2f& p : points) {
        if (p.x >= 60 && p.x < 380 && p.y >= 60 && p.y < 380) result.emplace_back(p.x - 60, p.y - 60);
      }
      return result;
    };
    mask.start(inside(stage.points(kBefore, true)), inside(stage.points(kBefore, false)), kBefore,
               kBefore * kStepPx);
    return mask.mask().clone();
  };
  const cv::Mat expected = mask_of_last(false);
  ASSERT_GT(cv::countNonZero(expected), 0);
  EXPECT_EQ(cv::norm(expected, mask_of_last(true), cv::NORM_INF), 0);
}

TEST(MotionMask, FindsTheOutlineOfWhatMoves) {
  const Stage stage;
  MotionMask mask(motion_options());
  start(stage, &mask);
  EXPECT_GT(overlap(mask.mask(), stage.image(kBefore).object), 0.75);
  for (int i = kBefore + 1; i < 30; ++i) {
    follow(stage, i, &mask);
    EXPECT_GT(overlap(mask.mask(), stage.image(i).object), 0.85) << i;
  }
}

TEST(MotionMask, AnObjectThatStopsStaysTheObject) {
  const Stage stage;
  MotionMask mask(motion_options());
  start(stage, &mask);
  for (int i = kBefore + 1; i < 20; ++i) follow(stage, i, &mask);
  for (int i = 0; i < 30; ++i) {
    mask.watch(stage.image(19).bgr);
    mask.observe(stage.points(19, true), 0);
  }
  EXPECT_GT(overlap(mask.mask(), stage.image(19).object), 0.85);
}

TEST(MotionMask, WhatIsKnownOfTheBackgroundServesImagesOutOfOrder) {
  const Stage stage;
  MotionMask mask(motion_options());
  start(stage, &mask);
  for (int i = kBefore + 1; i < 40; ++i) follow(stage, i, &mask);
  EXPECT_GT(overlap(mask.mask_of(stage.image(10).bgr), stage.image(10).object), 0.75);
}

TEST(MotionMask, ACameraThatIsMovedIsNoticed) {
  const Stage stage;
  MotionMask mask(motion_options());
  start(stage, &mask);
  for (int i = kBefore + 1; i < 20; ++i) {
    follow(stage, i, &mask);
    EXPECT_GT(overlap(mask.mask_of(stage.image(i).bgr), stage.image(i).object), 0.85)
        << "it is known in " << i;
  }
  const cv::Point jolt(25, 10);
  const ObjectImage moved = stage.image(19, jolt);
  for (int i = 0; i < 10; ++i) {
    mask.watch(moved.bgr);
    mask.observe(stage.points(19, true), 0);
    if (i > 0) continue;
    EXPECT_LT(overlap(mask.mask(), moved.object), 0.2) << "all is another than what is known";
  }
  // What is nearer to the object's features than to still texture.
  EXPECT_GT(overlap(mask.mask(), moved.object), 0.5) << "what was known is held against it still";
  EXPECT_LT(overlap(mask.mask_of(moved.bgr), moved.object), 0.2) << "nothing is known of images out of order";
  for (int i = 20; i < 30; ++i) {
    mask.watch(stage.image(i, jolt).bgr);
    mask.observe(stage.points(i, true), kStepPx);
  }
  EXPECT_GT(overlap(mask.mask(), stage.image(29).object), 0.85) << "the object stays the object";
}

TEST(MotionMask, ResetForgets) {
  const Stage stage;
  MotionMask mask(motion_options());
  start(stage, &mask);
  mask.reset();
  EXPECT_FALSE(mask.is_started());
  EXPECT_TRUE(mask.mask().empty());
}

}  // namespace
}  // namespace mono_pose_tracker
