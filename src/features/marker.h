#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {

/// Names of the known dictionaries of square markers (OpenCV's aruco): "4x4_50", ..., "original". Empty when
/// the package was built without OpenCV's aruco module.
const std::vector<std::string>& marker_dictionaries();

/// The four corners of a marker in a grey image (CV_8UC1), in px with the centre of the first pixel at (0,
/// 0), clockwise as printed, from its top left. Nothing when it is not in the image. Throws
/// std::invalid_argument on a dictionary that is not known.
std::vector<Eigen::Vector2d> find_marker(const cv::Mat& gray, const std::string& dictionary, int id);

}  // namespace mono_pose_tracker
