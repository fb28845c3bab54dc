#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>
#include <string_view>

namespace mono_pose_tracker {

/// Of the content of an image, to recognise it within a process.
inline std::size_t pixel_hash(const cv::Mat& image) {
  const cv::Mat pixels = image.isContinuous() ? image : image.clone();
  return std::hash<std::string_view>()(
      {reinterpret_cast<const char*>(pixels.data), pixels.total() * pixels.elemSize()});
}

}  // namespace mono_pose_tracker
