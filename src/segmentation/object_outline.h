#pragma once

#include <opencv2/core.hpp>

#include "segmentation/object_points.h"

namespace mono_pose_tracker {

/// The outline of an object from its points and its appearance: GrabCut (Rother, Kolmogorov and Blake,
/// SIGGRAPH 2004; OpenCV's) on the image reduced to a width of 320 px. It starts with the region near the
/// object's points and farther from the others. image: CV_8UC1 or CV_8UC3 (BGR). Returns CV_8UC1 of its size,
/// 255: object. Empty if too few of the points are in the image, or the outline excludes many of them.
cv::Mat outline_object(const cv::Mat& image, const ObjectPoints& points);

}  // namespace mono_pose_tracker
