#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

#include "io/image_coding.h"
#include "mono_pose_tracker/common/status.h"

namespace mono_pose_tracker {

/// An image as the tracker takes it, or why there is none.
struct ConvertedImage {
  cv::Mat image;  // CV_8UC1 or CV_8UC3 (BGR); may share the message's memory
  Reason reason = Reason::kOk;
  std::string error;                   // one line, when reason is not kOk
  sensor_msgs::ImageConstPtr message;  // keeps the memory that may be shared
  cv::Mat mask = cv::Mat();            // of an image with alpha (mask_of_alpha)
};

/// mono8, mono16, 8UC1, 16UC1, 8UC3, 8UC4, 16UC3, 16UC4 (blue first), rgb8, bgr8, rgba8, bgra8, the same of
/// 16 bits, the bayer patterns of 8 and 16 bits and yuv422 (UYVY and YUY2). 16 bits are divided by 256.
/// Anything else: kUnsupportedEncoding; a message that contradicts itself (empty, or shorter than its size
/// says): kUnreadableImage.
ConvertedImage convert_image(const sensor_msgs::ImageConstPtr& message, const GreyLevels& levels = {});

/// As convert_image, with all bits.
ConvertedImage convert_with_all_bits(const sensor_msgs::ImageConstPtr& message);

/// A mask as the tracker takes it: CV_8UC1, 0 = ignore, 255 = use, which is whatever is not 0 in the message.
/// Encodings as of images. Where some of it is transparent, alpha alone decides.
ConvertedImage convert_mask(const sensor_msgs::ImageConstPtr& message);

/// The problem of a compressed image that could not be decoded, with the format that its message states: a
/// stream of video (h264) is no image. problem: empty stays empty.
std::string with_format(const std::string& problem, const std::string& format);

/// Decodes a compressed image into an image message (mono8, bgr8, bgra8, or the same of 16 bits) with the
/// same header; an orientation tag is ignored. Throws std::runtime_error, one line, on what cannot be
/// decoded, is cut, or promises more than max_pixels.
sensor_msgs::ImagePtr decode_image(const sensor_msgs::CompressedImage& message,
                                   std::uint64_t max_pixels = kMaxImagePixels);

}  // namespace mono_pose_tracker
