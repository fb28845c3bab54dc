#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// Writes an image in the format of the path's extension, atomically: readers get the whole file or none.
/// False when the extension names no format or one that cannot hold the image. Throws std::runtime_error
/// naming the path and the reason when the file cannot be written.
bool write_image_as_named(const std::string& path, const cv::Mat& image);

/// Writes an image (8 bits a channel) in the format of the path's extension, and as PNG when the extension
/// names no format or one that cannot hold the image (readers detect the format by content). Otherwise as
/// write_image_as_named.
void write_image(const std::string& path, const cv::Mat& image);

}  // namespace mono_pose_tracker
