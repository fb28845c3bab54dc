#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

struct ColmapObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // as in the image: centre of the first pixel at (0, 0)
  int point = -1;                                   // index into the points, -1: none
};

struct ColmapImage {
  std::string name;  // relative to the image folder
  Rigid3 camera_from_map;
  std::vector<ColmapObservation> observations;
};

struct ColmapPoint {
  Eigen::Vector3d x_in_map = Eigen::Vector3d::Zero();
  std::uint8_t r = 0, g = 0, b = 0;
  double error_px = 0;  // mean reprojection error
};

/// Writes COLMAP's text model of one camera (cameras.txt, images.txt, points3D.txt; ids count from 1 in the
/// given order) into a folder, which is made when it is not there. COLMAP puts the centre of the first pixel
/// at (0.5, 0.5): the principal point and the observations are moved there. An image without observations
/// gets one of no point, in its middle: no line is empty. Throws std::runtime_error naming the path when it
/// cannot write, and std::invalid_argument on an observation of a point that is not given.
void write_colmap_text(const std::string& folder, const CameraParameters& camera,
                       const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points);

}  // namespace mono_pose_tracker
