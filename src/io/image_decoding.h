#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "io/grey_levels.h"

namespace mono_pose_tracker {

/// Largest decoded image [px]: a small file can claim more than the available memory. It exceeds the cameras
/// of robots; at 8 bytes a pixel it takes 0.8 GB.
constexpr std::uint64_t kMaxImagePixels = 100'000'000;

/// An image as the tracker takes it (CV_8UC1 or CV_8UC3, BGR), or the problem in one line.
struct DecodedImage {
  cv::Mat image;
  std::string problem;  // empty when there is an image
  /// CV_8UC1, 0 where the file is transparent (alpha 0), else 255; empty: nowhere, or all of it is.
  cv::Mat mask = cv::Mat();
};

/// True for the file names that are taken for images (by their extension).
bool has_image_extension(const std::string& path);

/// Reads an image file of at most kMaxImagePixels. The orientation tag is ignored, because a calibration
/// refers to the pixels as stored. levels: for 16 bits.
DecodedImage read_image(const std::string& path, const GreyLevels& levels = {});

/// As read_image, with all bits and channels of the file.
DecodedImage read_unchanged(const std::string& path);

/// As read_image, from the bytes of the file. The size is read from the header and checked against max_pixels
/// before decoding; formats with an unknown header are refused.
DecodedImage decode_image(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels = kMaxImagePixels,
                          const GreyLevels& levels = {});

/// As decode_image, with all bits and channels.
DecodedImage decode_unchanged(const std::vector<unsigned char>& bytes,
                              std::uint64_t max_pixels = kMaxImagePixels);

/// Images of 16 bits between these levels, by default their upper 8 bits; what is transparent is in the mask.
DecodedImage to_8_bit(const cv::Mat& image, const GreyLevels& levels = {});

}  // namespace mono_pose_tracker
