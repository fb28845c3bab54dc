#include <gtest/gtest.h>

#include "segmentation/object_images.h"
#include "segmentation/segmenter.h"

namespace mono_pose_tracker {
namespace {

TEST(Otsu, CutsBetweenTwoClassesAndSaysHowFarApartTheyAre) {
  std::array<double, 256> histogram{};
  for (int i = 0; i < 20; ++i) histogram[30 + i] = histogram[150 + i] = 1;
  const OtsuCut cut = otsu_cut(histogram);
  EXPECT_GE(cut.level, 49);
  EXPECT_LT(cut.level, 150);
  EXPECT_GT(cut.separation, 0.95);
}

TEST(Otsu, ACutOfOneClassSeparatesLittle) {
  std::array<double, 256> histogram{};
  for (int i = 0; i < 256; ++i) histogram[i] = std::exp(-0.5 * (i - 100) * (i - 100) / 400.0);
  EXPECT_NEAR(otsu_cut(histogram).separation, 2 / M_PI, 0.01);
}

TEST(Otsu, NothingAndOneValueAreNotCut) {
  std::array<double, 256> histogram{};
  EXPECT_EQ(otsu_cut(histogram).separation, 0);
  histogram[7] = 5;
  EXPECT_EQ(otsu_cut(histogram).separation, 0);
}

TEST(Threshold, AnImageMayBeALine) {
  for (const cv::Size size : {cv::Size(1, 40), cv::Size(40, 1), cv::Size(1, 1)}) {
    const cv::Mat line(size, CV_8UC3, cv::Scalar::all(90));
    EXPECT_EQ(threshold_foreground(line, Backdrop::kAuto, -1).size(), size);
  }
}

TEST(Threshold, FindsTheObjectBeforeADarkAndABrightBackdrop) {
  for (const double backdrop : {20.0, 235.0}) {
    const ObjectImage image = object_before({backdrop, backdrop, backdrop}, {120, 130, 140}, 4, 1);
    EXPECT_GT(overlap(threshold_foreground(image.bgr, Backdrop::kAuto, -1), image.object), 0.97) << backdrop;
  }
}

TEST(Threshold, ADarkHeadOfHairIsNotTakenForTheDarkBackdrop) {
  ObjectImage image = object_before({18, 20, 22}, {170, 180, 190}, 4, 1);
  // The upper half of the object is nearly dark.
  const cv::Mat upper = image.object(cv::Rect(0, 0, image.object.cols, image.object.rows / 2));
  image.bgr(cv::Rect(0, 0, image.object.cols, image.object.rows / 2)).setTo(cv::Scalar(50, 60, 70), upper);
  EXPECT_GT(overlap(threshold_foreground(image.bgr, Backdrop::kAuto, -1), image.object), 0.95);
}

TEST(Threshold, TakesTheGivenLevel) {
  const ObjectImage image = object_before({100, 100, 100}, {140, 140, 140}, 2, 1);
  EXPECT_GT(overlap(threshold_foreground(image.bgr, Backdrop::kDark, 120), image.object), 0.97);
  EXPECT_EQ(cv::countNonZero(threshold_foreground(image.bgr, Backdrop::kDark, 180)), 0);
  cv::Mat gray(image.object.size(), CV_8UC1, cv::Scalar(100));
  gray.setTo(140, image.object);
  EXPECT_GT(overlap(threshold_foreground(gray, Backdrop::kDark, 120), image.object), 0.97);
}

TEST(Chroma, FindsTheObjectBeforeGreenAndBlue) {
  const ObjectImage green = object_before({60, 190, 70}, {120, 140, 200}, 4, 1);
  EXPECT_GT(overlap(chroma_foreground(green.bgr, Chroma::kGreen, -1), green.object), 0.97);
  const ObjectImage blue = object_before({200, 80, 40}, {120, 140, 200}, 4, 1);
  EXPECT_GT(overlap(chroma_foreground(blue.bgr, Chroma::kBlue, -1), blue.object), 0.97);
  EXPECT_GT(overlap(chroma_foreground(blue.bgr, Chroma::kBlue, 60), blue.object), 0.97);
}

TEST(Chroma, AGreyImageHasNoBackdrop) {
  EXPECT_EQ(cv::countNonZero(chroma_foreground(cv::Mat::zeros(10, 20, CV_8UC1), Chroma::kGreen, -1)), 200);
}

constexpr int kLearning = 10;
const cv::Size kPlainSize(640, 480);

SegmentationOptions with_method(const std::string& method) {
  SegmentationOptions options;
  options.method = method;
  options.learning_frames = kLearning;
  return options;
}

// A textured object that moves before a textured background, with sensor noise.
class PlainStage {
 public:
  cv::Mat empty(int frame) const {
    cv::Mat image = background_.clone();
    add_noise(2, 100 + frame, &image);
    return image;
  }
  ObjectImage with_object(int frame) const {
    ObjectImage image{background_.clone(), cv::Mat::zeros(kPlainSize, CV_8UC1)};
    cv::ellipse(image.object, {300 + 3 * frame, 240}, {110, 160}, 0, 0, 360, 255, cv::FILLED);
    object_.copyTo(image.bgr, image.object);
    add_noise(2, 500 + frame, &image.bgr);
    return image;
  }

 private:
  cv::Mat background_ = texture(kPlainSize, 1), object_ = texture(kPlainSize, 2);
};

void learn(const PlainStage& stage, Segmenter* segmenter) {
  for (int i = 0; i < kLearning; ++i) segmenter->segment(stage.empty(i), cv::Mat());
}

TEST(Segmenter, NoMethodMeansNoMaskAndAGivenMaskIsTakenAsItIs) {
  const ObjectImage image = PlainStage().with_object(0);
  EXPECT_TRUE(Segmenter(with_method("none")).segment(image.bgr, image.object).mask.empty());
  for (const char* method : {"auto", "mask"}) {
    Segmenter segmenter(with_method(method));
    EXPECT_TRUE(segmenter.segment(image.bgr, cv::Mat()).mask.empty());
    const cv::Mat given = image.object / 100;  // any value but 0 is the object
    EXPECT_EQ(overlap(segmenter.segment(image.bgr, given).mask, image.object), 1);
  }
}

TEST(Segmenter, SaysThatItLearnsTheBackgroundAndForHowLong) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  for (int i = 0; i < kLearning; ++i) {
    const Segmentation segmentation = segmenter.segment(stage.empty(i), cv::Mat());
    EXPECT_EQ(segmentation.reason, Reason::kLearningBackground);
    EXPECT_EQ(segmentation.text, "learning the background: image " + std::to_string(i + 1) + " of 10");
    EXPECT_EQ(cv::countNonZero(segmentation.mask), 0);
  }
  EXPECT_EQ(segmenter.segment(stage.empty(kLearning), cv::Mat()).reason, Reason::kOk);
}

// A folder may hold both.
TEST(Segmenter, GreyImagesAmongColouredOnesAreAnotherBackground) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  for (int i = 0; i < kLearning / 2; ++i) segmenter.segment(stage.empty(i), cv::Mat());
  for (int i = 0; i < kLearning; ++i) {
    cv::Mat gray;
    cv::cvtColor(stage.empty(i), gray, cv::COLOR_BGR2GRAY);
    const Segmentation segmentation = segmenter.segment(gray, cv::Mat());
    EXPECT_EQ(segmentation.text, "learning the background: image " + std::to_string(i + 1) + " of 10");
  }
  ObjectImage image = stage.with_object(0);
  cv::cvtColor(image.bgr, image.bgr, cv::COLOR_BGR2GRAY);
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.9);
}

TEST(Segmenter, FindsTheObjectBeforeALearntBackground) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  learn(stage, &segmenter);
  EXPECT_EQ(cv::countNonZero(segmenter.segment(stage.empty(50), cv::Mat()).mask), 0);
  for (int i = 0; i < 20; ++i) {
    const ObjectImage image = stage.with_object(i);
    EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.95) << i;
  }
}

TEST(Segmenter, WhatPassesByWhileLearningIsNotLearnt) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  for (int i = 0; i < kLearning; ++i) {
    segmenter.segment(i % 4 == 1 ? stage.with_object(i).bgr : stage.empty(i), cv::Mat());
  }
  const ObjectImage image = stage.with_object(0);
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.93);
}

TEST(Segmenter, AShadowIsNotTheObject) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  learn(stage, &segmenter);
  ObjectImage image = stage.with_object(0);
  cv::Mat shadow = cv::Mat::zeros(kPlainSize, CV_8UC1);
  cv::ellipse(shadow, {480, 300}, {110, 140}, 0, 0, 360, 255, cv::FILLED);
  shadow.setTo(0, image.object);
  cv::Mat darker = 0.65 * image.bgr;
  darker.copyTo(image.bgr, shadow);
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.9);
}

TEST(Segmenter, AnExposureThatChangesIsFollowed) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  learn(stage, &segmenter);
  for (int i = 0; i < 20; ++i) {
    ObjectImage image = stage.with_object(i);
    image.bgr *= 1 + 0.2 * std::sin(0.5 * i);
    EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.93) << i;
  }
}

TEST(Segmenter, TheBackgroundIsUpdatedOutsideTheObjectOnly) {
  const PlainStage stage;
  SegmentationOptions options = with_method("background");
  options.update_rate = 0.2;
  Segmenter segmenter(options);
  learn(stage, &segmenter);
  // The object stands still for long: it must not become background.
  ObjectImage image;
  for (int i = 0; i < 40; ++i) {
    image = stage.with_object(0);
    segmenter.segment(image.bgr, cv::Mat());
  }
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.95);
  EXPECT_EQ(cv::countNonZero(segmenter.segment(stage.empty(60), cv::Mat()).mask), 0);
}

TEST(Segmenter, ABackgroundImageNeedsNoLearning) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"), stage.empty(0));
  ObjectImage image = stage.with_object(0);
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.95);
  // Of a grey camera, too.
  cv::cvtColor(image.bgr, image.bgr, cv::COLOR_BGR2GRAY);
  EXPECT_GT(overlap(segmenter.segment(image.bgr, cv::Mat()).mask, image.object), 0.93);
}

TEST(Segmenter, ABackgroundImageOfAnotherSizeIsNotStretched) {
  Segmenter segmenter(with_method("background"), cv::Mat(240, 320, CV_8UC3, cv::Scalar(1, 2, 3)));
  const Segmentation segmentation = segmenter.segment(PlainStage().empty(0), cv::Mat());
  EXPECT_EQ(segmentation.reason, Reason::kImageSizeMismatch);
  EXPECT_EQ(segmentation.text, "segmentation/background_image is 320x240, the image 640x480");
}

TEST(Segmenter, AGivenMaskAndAMethodMustAgree) {
  const ObjectImage image = PlainStage().with_object(0);
  Segmenter segmenter(with_method("threshold"));
  cv::Mat left = cv::Mat::zeros(kPlainSize, CV_8UC1);
  left.colRange(0, 300) = 255;
  const cv::Mat plain = cv::Mat(kPlainSize, CV_8UC3, cv::Scalar(20, 20, 20));
  cv::Mat bgr = plain.clone();
  bgr.setTo(cv::Scalar(150, 150, 150), image.object);
  EXPECT_GT(overlap(segmenter.segment(bgr, left).mask, image.object & left), 0.97);
}

TEST(Segmenter, OutOfOrderNothingIsLearnt) {
  const PlainStage stage;
  Segmenter segmenter(with_method("background"));
  for (int i = 0; i < 3 * kLearning; ++i) {
    EXPECT_EQ(segmenter.segment_again(stage.empty(i), cv::Mat()).reason, Reason::kLearningBackground);
  }
  learn(stage, &segmenter);
  const ObjectImage image = stage.with_object(0);
  EXPECT_GT(overlap(segmenter.segment_again(image.bgr, cv::Mat()).mask, image.object), 0.95);
}

}  // namespace

}  // namespace mono_pose_tracker
