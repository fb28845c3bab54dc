#include <gtest/gtest.h>

#include <cmath>

#include "common/statistics.h"
#include "segmentation/object_images.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {
namespace {

TEST(CleanMask, SpecksGoHolesAreFilledGapsClose) {
  const cv::Mat truth = ellipse_mask({320, 240}, {160, 120});
  cv::Mat raw = truth.clone();
  cv::circle(raw, {160, 120}, 12, 0, cv::FILLED);                       // a hole
  cv::line(raw, {100, 150}, {220, 150}, 0, 3);                          // a gap that cuts it in two
  for (int x = 5; x < 320; x += 20) raw.at<std::uint8_t>(10, x) = 255;  // specks
  EXPECT_GT(overlap(clean_mask(raw, 1, 4, 1, 100), truth), 0.98);
}

TEST(CleanMask, KeepsTheLargestComponentsOfEnoughArea) {
  cv::Mat raw = cv::Mat::zeros(100, 200, CV_8UC1);
  raw(cv::Rect(10, 10, 40, 40)) = 255;
  raw(cv::Rect(80, 10, 30, 30)) = 255;
  raw(cv::Rect(150, 10, 10, 10)) = 255;
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 1, 50)), 1600);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 2, 50)), 2500);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 50)), 2600);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 200)), 2500);
  EXPECT_EQ(cv::countNonZero(clean_mask(raw, 0, 0, 9, 5000)), 0);
}

TEST(CleanMask, AnObjectThatTheBorderCutsStaysWhole) {
  cv::Mat raw = cv::Mat::zeros(100, 200, CV_8UC1);
  raw(cv::Rect(60, 40, 80, 60)) = 255;  // down to the lower border
  EXPECT_GT(overlap(clean_mask(raw, 2, 4, 1, 100), raw), 0.99);
}

TEST(Clearance, AFeatureKeepsMarginAndScalesFromTheEdge) {
  cv::Mat mask(41, 101, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 20) = 0;  // the edge: column 19 is the last outside
  const cv::Mat clearance = clearance_of(mask, 3, 2, 8);
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 10), 0);
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 22), 0);        // 3 px from column 19
  EXPECT_NEAR(clearance.at<std::uint8_t>(20, 26), 16, 1);  // 4 px of room: a scale of 2 px
  EXPECT_EQ(clearance.at<std::uint8_t>(20, 100), 255);     // the image's border is no edge
}

TEST(Clearance, WithoutMarginTheWholeMaskIsOpen) {
  const cv::Mat mask = ellipse_mask({320, 240}, {160, 120});
  EXPECT_EQ(cv::countNonZero(clearance_of(mask, 0, 0, 8) != mask), 0);
}

const cv::Size kImageSize(40, 30);

TEST(ObjectPoints, DistancesAreFromTheNearest) {
  const cv::Mat1f distances = distances_from({{10, 10}, {30.4F, 9.6F}}, kImageSize);
  EXPECT_EQ(distances.size(), kImageSize);
  EXPECT_FLOAT_EQ(distances(10, 10), 0);
  EXPECT_FLOAT_EQ(distances(10, 30), 0) << "to the nearest pixel";
  EXPECT_FLOAT_EQ(distances(10, 13), 3);
  EXPECT_FLOAT_EQ(distances(20, 30), 10);
}

TEST(ObjectPoints, WhereNoneIsInTheImageAllIsFarther) {
  const double diagonal = std::hypot(kImageSize.width, kImageSize.height);
  for (const auto& points :
       {std::vector<cv::Point2f>(), std::vector<cv::Point2f>{{-3, 5}, {40, 5}, {5, 30}}}) {
    double least = 0;
    cv::minMaxLoc(distances_from(points, kImageSize), &least);
    EXPECT_GT(least, diagonal);
  }
}

TEST(ObjectPoints, ReachIsHalfTheUsualDistanceFromTheMiddle) {
  EXPECT_FLOAT_EQ(reach_of({{7, 9}}), 0);
  // A single outlier does not lengthen it.
  EXPECT_FLOAT_EQ(reach_of({{0, 0}, {-8, 0}, {8, 0}, {0, 8}, {0, -8}, {900, 0}}), 4);
}

// Features on the inner part of the object's mask, and outside it.
ObjectPoints features_of(const cv::Mat& object, int count) {
  cv::Mat inner, outside;
  cv::erode(object, inner, cv::Mat(), {-1, -1}, 6);
  cv::dilate(object, outside, cv::Mat(), {-1, -1}, 6);
  ObjectPoints points;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    const cv::Point p(static_cast<int>(random.index(object.cols)),
                      static_cast<int>(random.index(object.rows)));
    if (inner.at<std::uint8_t>(p)) points.object.emplace_back(p);
    if (!outside.at<std::uint8_t>(p)) points.other.emplace_back(p);
  }
  return points;
}

const ObjectImage kImage = object_before({200, 190, 180}, {40, 60, 120}, 8, 1);

TEST(OutlineObject, FindsTheEdgeByColours) {
  const ObjectPoints points = features_of(kImage.object, 400);
  const cv::Mat outline = outline_object(kImage.bgr, points);
  ASSERT_EQ(outline.type(), CV_8UC1);
  EXPECT_GT(overlap(outline, kImage.object), 0.97);
}

TEST(OutlineObject, NeedsNoPointOfAnythingElse) {
  ObjectPoints points = features_of(kImage.object, 400);
  points.other.clear();
  EXPECT_GT(overlap(outline_object(kImage.bgr, points), kImage.object), 0.97);
}

TEST(OutlineObject, TakesGreyAndLargeImages) {
  cv::Mat gray, large;
  cv::cvtColor(kImage.bgr, gray, cv::COLOR_BGR2GRAY);
  ObjectPoints points = features_of(kImage.object, 400);
  EXPECT_GT(overlap(outline_object(gray, points), kImage.object), 0.97);
  cv::resize(kImage.bgr, large, {1280, 960});
  for (auto* of : {&points.object, &points.other}) {
    for (cv::Point2f& p : *of) p = (p + cv::Point2f(0.5F, 0.5F)) * 4 - cv::Point2f(0.5F, 0.5F);
  }
  cv::Mat large_object;
  cv::resize(kImage.object, large_object, large.size());
  EXPECT_GT(overlap(outline_object(large, points), large_object >= 128), 0.97);
}

// Of the object's colour, but with features that are not its own.
TEST(OutlineObject, ExcludesSimilarColoursThatMoveIndependently) {
  cv::Mat image = kImage.bgr.clone(), other = ellipse_mask(image.size(), {275, 120}) & ~kImage.object;
  cv::Mat gap;
  cv::dilate(kImage.object, gap, cv::Mat(), {-1, -1}, 8);
  other &= ~gap;
  image.setTo(cv::Scalar(40, 60, 120), other);
  const cv::Mat outline = outline_object(image, features_of(kImage.object, 400));
  ASSERT_FALSE(outline.empty());
  EXPECT_GT(overlap(outline, kImage.object), 0.95);
}

TEST(OutlineObject, IsEmptyWhereTooLittleIsKnown) {
  ObjectPoints points = features_of(kImage.object, 400);
  points.object.resize(15);
  EXPECT_TRUE(outline_object(kImage.bgr, points).empty());
  for (int i = 0; i < 50; ++i) points.object.emplace_back(-10.0F, 5.0F * static_cast<float>(i));
  EXPECT_TRUE(outline_object(kImage.bgr, points).empty()) << "outside the image";
  ObjectPoints everywhere;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) everywhere.object.emplace_back(x, y);
  }
  EXPECT_TRUE(outline_object(kImage.bgr, everywhere).empty()) << "all of the image is the object";
}

// OpenCV's cut does not end on such areas, or takes seconds.
TEST(OutlineObject, IsFoundInImagesWithoutNoise) {
  ObjectImage image = object_before({255, 255, 255}, {40, 60, 120}, 0, 1);
  image.bgr.at<cv::Vec3b>(20, 20) = {254, 255, 255};
  image.bgr.at<cv::Vec3b>(120, 160) = {40, 61, 120};
  EXPECT_GT(overlap(outline_object(image.bgr, features_of(image.object, 400)), image.object), 0.97);
  cv::Mat flat(image.bgr.size(), CV_8UC1, cv::Scalar(128));
  flat.at<std::uint8_t>(120, 160) = 200;
  const cv::Mat outline =
      outline_object(flat, features_of(image.object, 400));  // by the points alone, or none
  EXPECT_TRUE(outline.empty() || overlap(outline, image.object) > 0.3);
}

TEST(OutlineObject, IsTheSameWheneverItIsAsked) {
  const ObjectPoints points = features_of(kImage.object, 400);
  const cv::Mat first = outline_object(kImage.bgr, points);
  cv::theRNG().state = 12345;
  const cv::Mat second = outline_object(kImage.bgr, points);
  EXPECT_EQ(cv::theRNG().state, 12345U) << "others' random numbers are left alone";
  EXPECT_EQ(cv::norm(first, second, cv::NORM_INF), 0);
}

}  // namespace

}  // namespace mono_pose_tracker
