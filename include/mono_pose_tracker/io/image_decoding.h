#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {

/// An image as the tracker takes it (CV_8UC1 or CV_8UC3, BGR), or the problem in one line.
struct DecodedImage {
  cv::Mat image;
  std::string problem;  // empty when there is an image
};

/// True for the file names that are taken for images (by their extension).
bool has_image_extension(const std::string& path);

/// Reads an image file. Its orientation tag is ignored: a calibration is of the pixels as they lie in the
/// file.
DecodedImage read_image(const std::string& path);

/// As read_image, with all bits and channels of the file.
DecodedImage read_unchanged(const std::string& path);

/// As read_image, from the file's bytes.
DecodedImage decode_image(const std::vector<unsigned char>& bytes);

/// 16-bit images lose their lower 8 bits, transparency is dropped.
DecodedImage to_8_bit(const cv::Mat& image);

}  // namespace mono_pose_tracker
