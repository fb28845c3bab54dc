#pragma once

#include <string>
#include <vector>

#include "mono_pose_tracker/io/colmap.h"

namespace mono_pose_tracker {

/// Writes COLMAP's binary model (cameras.bin, images.bin, points3D.bin) of one pinhole camera, with the ids
/// and the pixel convention of write_colmap_text. Throws std::runtime_error naming the path when it cannot
/// write, and std::invalid_argument on a camera with distortion or an observation of a point that is not
/// given. Format: COLMAP's documentation, "Output Format".
///
///     write_colmap_text("sparse/0", camera, images, points);
///     write_colmap_binary("sparse/0", camera, images, points);  // the same model
void write_colmap_binary(const std::string& folder, const CameraParameters& camera,
                         const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points);

}  // namespace mono_pose_tracker
