#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/colmap.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "tracking/finished_map.h"

namespace mono_pose_tracker {

using PixelChange = std::function<Eigen::Vector2d(const Eigen::Vector2d&)>;

struct ColmapModelOptions {
  /// Largest reprojection error of an observation in an image that is no keyframe [px]; observations beyond
  /// it are excluded. Equal to that of COLMAP's mapper (Mapper.filter_max_reproj_error).
  double max_error_px = 4;
};

struct ColmapModel {
  std::vector<ColmapImage> images;
  std::vector<ColmapPoint> points;
};

/// The map and the poses as COLMAP's model; pixels of observations are mapped by `changed` into images of
/// `camera`. An image that is no keyframe lists the landmarks by which it was registered, if they are still
/// in the map and project near their pixels.
ColmapModel colmap_model_of(const CameraParameters& camera, const FinishedMap& map,
                            const std::vector<RegisteredFrame>& trajectory,
                            const std::map<std::int64_t, std::string>& names, const PixelChange& changed,
                            const ColmapModelOptions& options = {});

/// colmap_model_of as COLMAP's text model, in the folder.
void write_map_for_colmap(const std::string& folder, const CameraParameters& camera, const FinishedMap& map,
                          const std::vector<RegisteredFrame>& trajectory,
                          const std::map<std::int64_t, std::string>& names, const PixelChange& changed,
                          const ColmapModelOptions& options = {});

/// The names after COLMAP has read the model, if it changes them; empty: unchanged.
std::string doubt_of_names(const std::map<std::int64_t, std::string>& names);

}  // namespace mono_pose_tracker
