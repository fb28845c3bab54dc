#include "mapping/aliased_places.h"

#include "common/statistics.h"

namespace mono_pose_tracker {

double disagreement_px(const CameraModel& camera,
                       const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& x_in_camera) {
  constexpr double kNotSeen = 1e6;
  std::vector<double> errors;
  for (const auto& [x_expected, x_found] : x_in_camera) {
    Eigen::Vector2d expected, pixel;
    if (!camera.project(x_expected, &expected)) continue;
    errors.push_back(camera.project(x_found, &pixel) ? (pixel - expected).norm() : kNotSeen);
  }
  return errors.empty() ? kNotSeen : median(std::move(errors));
}

}  // namespace mono_pose_tracker
