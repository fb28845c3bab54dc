#include "segmentation/object_outline.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
