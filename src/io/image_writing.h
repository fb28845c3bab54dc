#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// Writes an image in the format that the path's extension names. A reader sees the whole file or none. False
/// when it names none or one that cannot hold the image. Throws std::runtime_error naming the path and the
/// reason when the file cannot be written.
bool write_image_as_named(const std::string& path, const cv::Mat& image);

/// Writes an image (8 bits a channel) in the format that the path's extension names, and as PNG where it
/// names none or one that cannot hold the image (readers go by what a file begins with). As
/// write_image_as_named otherwise.
void write_image(const std::string& path, const cv::Mat& image);

}  // namespace mono_pose_tracker
