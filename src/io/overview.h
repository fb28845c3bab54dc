#pragma once

#include <Eigen/Core>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

/// What a map looks like at a glance. Positions are in the map, whose axes are optical (x right, y down, z
/// forward).
struct Overview {
  std::string title;
  std::string unit = "map units";    // of all lengths
  std::vector<ColoredPoint> points;  // drawn in their own colours
  // By time, drawn from blue to red; start and end are marked. no_camera() breaks the line that joins them.
  std::vector<Eigen::Vector3d> cameras;
  std::vector<Eigen::Vector3d> true_cameras;  // by time, a wide black line below; may be empty
};

/// Stands for images without a pose.
inline Eigen::Vector3d no_camera() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

/// Two panels with equal axes: from above (x, z), and from the side: -y upwards, and to the right the
/// direction across it in which points and cameras spread most. The view holds every camera, and the
/// points round its way but for what is far beyond what it mostly saw.
cv::Mat draw_overview(const Overview& overview);

/// Writes draw_overview's picture. Throws std::runtime_error naming the path when it cannot.
void write_overview(const std::string& path, const Overview& overview);

}  // namespace mono_pose_tracker
