#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

using PixelChange = std::function<Eigen::Vector2d(const Eigen::Vector2d&)>;

/// The map and the poses as COLMAP's text model, in the folder; pixels of observations as `changed` has them.
void write_map_for_colmap(const std::string& folder, const CameraParameters& camera, const Map& map,
                          const std::vector<PosedFrame>& trajectory,
                          const std::map<std::int64_t, std::string>& names, const PixelChange& changed);

/// What COLMAP makes of the names when it reads the model; empty: what they are.
std::string doubt_of_names(const std::map<std::int64_t, std::string>& names);

}  // namespace mono_pose_tracker
