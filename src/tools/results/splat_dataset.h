#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/colmap.h"

namespace mono_pose_tracker {

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
