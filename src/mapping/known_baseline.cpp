#include "known_baseline.h"

#include <Eigen/Dense>
#include <cmath>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

namespace {

// Standard deviations: all depths that are measured by the baseline are off by a fifth as it is.
constexpr double kMinSignificance = 5;

// Information (inverse covariance) of a pose, x' = exp(w) x + v, order v, w; the landmarks held fixed.
Eigen::Matrix<double, 6, 6> information_of(const Map& map, const Keyframe& keyframe) {
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
    if (!landmark) continue;
    const Eigen::Vector3d x = keyframe.camera_from_map * landmark->x_in_map;
    const Eigen::Vector3d ray = x.normalized();
    const double px_per_rad = keyframe.image->pixel_from_bearing[f].norm() / std::sqrt(2.0);
    Eigen::Matrix<double, 3, 6> jacobian;  // of the ray
    jacobian.leftCols<3>() = (Eigen::Matrix3d::Identity() - ray * ray.transpose()) / x.norm();
    jacobian.rightCols<3>() = -jacobian.leftCols<3>() * cross_matrix(x);
    const double weight = px_per_rad / keyframe.image->sigma_px[f];
    information += weight * weight * jacobian.transpose() * jacobian;
  }
  return information;
}

// Variance of the keyframe's place along a direction of the map, of unit length.
double variance_along(const Map& map, const Keyframe& keyframe, const Eigen::Vector3d& direction_in_map) {
  Eigen::Matrix<double, 6, 1> direction = Eigen::Matrix<double, 6, 1>::Zero();
  direction.head<3>() = keyframe.camera_from_map.rotation * direction_in_map;
  return direction.dot(information_of(map, keyframe).ldlt().solve(direction));
}

}  // namespace

bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second) {
  const Eigen::Vector3d way = second.center_in_map() - first.center_in_map();
  const double length = way.norm();
  if (length <= 0) return false;
  const double variance =
      variance_along(map, first, way / length) + variance_along(map, second, way / length);
  return std::isfinite(variance) && length * length >= kMinSignificance * kMinSignificance * variance;
}

}  // namespace mono_pose_tracker
