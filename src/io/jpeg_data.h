#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mono_pose_tracker {

/// What libjpeg makes of the coded data of a JPEG.
struct JpegData {
  cv::Mat image;           // CV_8UC1 or CV_8UC3 (BGR); empty: to be decoded otherwise
  bool end_early = false;  // before the last pixel, whatever stands behind: libjpeg makes up the rest in grey
};

/// Where the data are neither grey nor of three channels, or libjpeg refuses them, there is no image. Throws
/// for lack of memory.
JpegData read_jpeg_data(const std::vector<unsigned char>& bytes);

}  // namespace mono_pose_tracker
