#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mono_pose_tracker {

/// Pixels of an image's features: of a body, and of what is not of it.
struct ObjectPoints {
  std::vector<cv::Point2f> object, other;
};

/// Of each pixel from the nearest of the points that lie in the image, px; where none does, farther than any.
cv::Mat1f distances_from(const std::vector<cv::Point2f>& points, const cv::Size& size);

/// How far a body goes on beyond its outermost points, px: a part of its size. There is at least one point.
float reach_of(const std::vector<cv::Point2f>& points);

}  // namespace mono_pose_tracker
