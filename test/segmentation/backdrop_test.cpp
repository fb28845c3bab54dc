#include "segmentation/segmenter.h"

#include <gtest/gtest.h>

#include "segmentation/object_images.h"

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

}  // namespace
}  // namespace mono_pose_tracker
