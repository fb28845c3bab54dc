#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mono_pose_tracker {

/// Pixels of the features of an image: on the object, and elsewhere.
struct ObjectPoints {
  std::vector<cv::Point2f> object, other;
};

/// Distance of each pixel from the nearest of the points in the image [px]; without any, larger than all
/// distances.
cv::Mat1f distances_from(const std::vector<cv::Point2f>& points, const cv::Size& size);

/// Distance by which the object extends beyond its outermost points [px], proportional to its size. At least
/// one point.
float reach_of(const std::vector<cv::Point2f>& points);

}  // namespace mono_pose_tracker
