#pragma once

#include <cstdint>
#include <opencv2/videoio.hpp>
#include <string>

namespace mono_pose_tracker {

/// Frames will be as the sensor read them: a flag of the file that asks for them to be turned (a phone held
/// upright) is not followed, as the orientation tag of an image is not (image_decoding.h). False when OpenCV
/// cannot read the file.
bool open_as_recorded(const std::string& path, cv::VideoCapture* capture);

/// The cause and what is expected, for a file of which open_as_recorded returned false. One line that
/// continues the file's name and a colon.
std::string cause_of_no_video(const std::string& path);

/// What to tell of a video of which so many frames could be read and that announces so many (-1: none): empty
/// unless clearly fewer could, as some containers only estimate how many there are.
std::string problem_of_end(std::int64_t frames, std::int64_t announced);

}  // namespace mono_pose_tracker
