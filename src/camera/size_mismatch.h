#pragma once

#include <string>

namespace mono_pose_tracker {

/// An image of another size than the calibration is for: both sizes, where the expected one comes from, and
/// the likely cause, one line that continues "the image ". origin: "image_width and image_height of
/// camera.yaml"; empty: not known.
std::string size_mismatch_text(int image_width, int image_height, int camera_width, int camera_height,
                               const std::string& origin);

}  // namespace mono_pose_tracker
