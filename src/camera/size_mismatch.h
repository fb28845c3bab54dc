#pragma once

#include <string>

namespace mono_pose_tracker {

/// Describes an image whose size differs from that of the calibration: both sizes, the origin of the expected
/// one, and the likely cause. One line that continues "the image ". origin: "image_width and image_height of
/// camera.yaml"; empty: not known.
std::string size_mismatch_text(int image_width, int image_height, int camera_width, int camera_height,
                               const std::string& origin);

}  // namespace mono_pose_tracker
