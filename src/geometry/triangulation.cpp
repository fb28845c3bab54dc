#include "geometry/triangulation.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "geometry/essential.h"

namespace mono_pose_tracker {
namespace {

/// A symmetric 3x3 system, refused when its reciprocal condition is below what 64 bits can carry.
bool solve(const Eigen::Matrix3d& information, const Eigen::Vector3d& gradient, Eigen::Vector3d* step) {
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(information);
  const Eigen::Vector3d d = ldlt.vectorD();
  if (!(d.minCoeff() > 1e-14 * d.maxCoeff())) return false;
  *step = ldlt.solve(gradient);
  return step->allFinite();
}

/// The point nearest to all rays.
bool nearest_to_rays(const std::vector<Rigid3>& cameras_from_map,
                     const std::vector<Eigen::Vector3d>& bearings, Eigen::Vector3d* x_in_map) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Eigen::Quaterniond map_from_camera = cameras_from_map[i].rotation.conjugate();
    const Eigen::Vector3d ray = map_from_camera * bearings[i];
    const Eigen::Vector3d center = -(map_from_camera * cameras_from_map[i].translation);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    information += across;
    gradient += across * center;
  }
  return solve(information, gradient, x_in_map);
}

/// One Gauss-Newton step on the angular errors; the residual of a view is its bearing minus the unit vector
/// to x.
bool refine_once(const std::vector<Rigid3>& cameras_from_map, const std::vector<Eigen::Vector3d>& bearings,
                 const Eigen::Vector3d& x_in_map, Eigen::Vector3d* step) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Eigen::Vector3d x_in_camera = cameras_from_map[i] * x_in_map;
    const double distance = x_in_camera.norm();
    if (!(distance > 0)) return false;
    const Eigen::Vector3d predicted = x_in_camera / distance;
    const Eigen::Matrix3d jacobian = (Eigen::Matrix3d::Identity() - predicted * predicted.transpose()) /
                                     distance * cameras_from_map[i].rotation_matrix();
    information += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * (bearings[i] - predicted);
  }
  return solve(information, gradient, step);
}

bool in_front_of_all(const std::vector<Rigid3>& cameras_from_map,
                     const std::vector<Eigen::Vector3d>& bearings, const Eigen::Vector3d& x_in_map) {
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    if (!((cameras_from_map[i] * x_in_map).dot(bearings[i]) > 0)) return false;
  }
  return true;
}

}  // namespace

bool triangulate_two_views(const Rigid3& second_from_first, const Eigen::Vector3d& bearing1,
                           const Eigen::Vector3d& bearing2, Eigen::Vector3d* x_in_first) {
  if (!is_in_front(second_from_first, bearing1, bearing2)) return false;
  const Eigen::Vector3d turned1 = second_from_first.rotation * bearing1;
  const Eigen::Vector3d& t = second_from_first.translation;
  const double p = turned1.cross(bearing2).norm();
  const double q = turned1.cross(t).norm();
  const double r = bearing2.cross(t).norm();
  // Rays that diverge by less (radians) are parallel: it is far below any camera's resolution, and still 1e5
  // times the rounding of a unit vector.
  if (!(p > 1e-10)) return false;
  // The points at depths r/p and q/p along the rays, weighted by the inverse of their depths.
  const Eigen::Vector3d x_in_second = q / (q + r) * (t + r / p * (turned1 + bearing2));
  *x_in_first = second_from_first.inverse() * x_in_second;
  return x_in_first->allFinite();
}

bool triangulate_multi_view(const std::vector<Rigid3>& cameras_from_map,
                            const std::vector<Eigen::Vector3d>& bearings, Eigen::Vector3d* x_in_map) {
  if (bearings.size() < 2 || cameras_from_map.size() != bearings.size()) return false;
  Eigen::Vector3d x;
  if (!nearest_to_rays(cameras_from_map, bearings, &x)) return false;
  if (!in_front_of_all(cameras_from_map, bearings, x)) return false;
  // Quadratic for small residuals: three or four steps reach rounding, ten are a guard.
  for (int iteration = 0; iteration < 10; ++iteration) {
    Eigen::Vector3d step;
    if (!refine_once(cameras_from_map, bearings, x, &step)) return false;
    x += step;
    if (step.squaredNorm() <= 1e-20 * x.squaredNorm()) break;
  }
  if (!x.allFinite() || !in_front_of_all(cameras_from_map, bearings, x)) return false;
  *x_in_map = x;
  return true;
}

Eigen::Vector3d common_direction(const std::vector<Rigid3>& cameras_from_map,
                                 const std::vector<Eigen::Vector3d>& bearings) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    sum += cameras_from_map[i].rotation.conjugate() * bearings[i];
  }
  return sum.normalized();
}

double parallax_angle(const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& center1_in_map,
                      const Eigen::Vector3d& center2_in_map) {
  const Eigen::Vector3d ray1 = x_in_map - center1_in_map;
  const Eigen::Vector3d ray2 = x_in_map - center2_in_map;
  return std::atan2(ray1.cross(ray2).norm(), ray1.dot(ray2));
}

}  // namespace mono_pose_tracker
