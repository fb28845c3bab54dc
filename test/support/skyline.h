#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

/// Points of a skyline at 3000 to 5000 units first, then points 2 to 5 units away.
inline std::vector<Eigen::Vector3d> skyline_points(int far, int near, Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < far + near; ++i) {
    const double depth = i < far ? random.uniform(3000, 5000) : random.uniform(2, 5);
    x.emplace_back(depth * random.uniform(-0.4, 0.4), depth * random.uniform(-0.3, 0.3), depth);
  }
  return x;
}

/// A camera that moves past such points, by 0.05 units and half a degree between views.
struct SkylineWalk {
  static constexpr int kViews = 10, kFarPoints = 80, kNearPoints = 120;
  static constexpr double kStep = 0.05;

  Random random{5};
  CameraModel camera = synthetic_camera();
  SyntheticScene scene{skyline_points(kFarPoints, kNearPoints, random), random};
  MapperOptions options;
  Map map;

  SkylineWalk() { options.ransac = ransac_of_two_px(camera); }

  static Rigid3 pose(int view) { return camera_at({kStep * view, 0, 0}, -0.5 * view * kDegree); }
};

}  // namespace mono_pose_tracker
