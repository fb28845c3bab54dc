#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// Writes an image (8 bits a channel) in the format that the path's extension names, and as PNG where it
/// names none or one that cannot hold the image (readers go by what a file begins with). A reader sees the
/// whole file or none. Throws std::runtime_error naming the path and the reason when it cannot.
void write_image(const std::string& path, const cv::Mat& image);

}  // namespace mono_pose_tracker
