#pragma once

#include <opencv2/videoio.hpp>
#include <string>

namespace mono_pose_tracker {

/// Frames will be as the sensor read them: a flag of the file that asks for them to be turned (a phone held
/// upright) is not followed, as the orientation tag of an image is not (image_decoding.h). False when OpenCV
/// cannot read the file.
bool open_as_recorded(const std::string& path, cv::VideoCapture* capture);

}  // namespace mono_pose_tracker
