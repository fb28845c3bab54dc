#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
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

struct SplatDatasetOptions {
  /// Share of the points that instant-ngp's unit cube holds, in (0, 1]: the finest of its grids.
  double unit_cube_share = 0.75;
  /// Share of the points, besides all cameras, that its largest box holds, in (0, 1]: farther ones are few
  /// and known badly.
  double box_share = 0.99;
};

/// Where the unit cube of instant-ngp lies: x_in_cube = scale * x_in_map + offset. The cube of side
/// aabb_scale (a power of 2 up to 128) with the same centre holds the scene.
struct NgpBox {
  double scale = 1;
  Eigen::Vector3d offset = Eigen::Vector3d::Constant(0.5);
  int aabb_scale = 1;
};

NgpBox ngp_box(const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points,
               const SplatDatasetOptions& options = {});

/// Writes what trainers of radiance fields read of a folder that holds images/NAME and masks/NAME.png of a
/// pinhole camera:
/// - sparse/0/{cameras,images,points3D}.{bin,txt}: the original Gaussian splatting, gsplat, Brush;
/// - transforms.json and sparse_pc.ply, its points: nerfstudio, instant-ngp.
/// Poses and points of all are in the map's frame and unit. Throws std::runtime_error naming the path when a
/// file cannot be written.
void write_splat_dataset(const std::string& folder, const CameraParameters& camera,
                         const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points,
                         const SplatDatasetOptions& options = {});

}  // namespace mono_pose_tracker
