#pragma once

#include <opencv2/core.hpp>

#include "segmentation/object_points.h"

namespace mono_pose_tracker {

/// The body's outline by where its points are and what it looks like: GrabCut (Rother, Kolmogorov and Blake,
/// SIGGRAPH 2004; OpenCV's), begun with what lies near the body's points and nearer than to the others, on
/// the image reduced to a width of 320 px. image: CV_8UC1 or CV_8UC3 (BGR). CV_8UC1 of its size, 255: of the
/// body; empty where too few of its points are in the image, or the outline leaves many of them out.
cv::Mat outline_object(const cv::Mat& image, const ObjectPoints& points);

}  // namespace mono_pose_tracker
