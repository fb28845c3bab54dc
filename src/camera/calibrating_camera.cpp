#include "camera/calibrating_camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "distortion.h"

namespace mono_pose_tracker {

CalibratingCamera::CalibratingCamera(const CameraParameters& start)
    : start_(CameraModel(start).parameters()), is_equidistant_(start.distortion_model == "equidistant") {
  if (start_.distortion_model.empty()) {
    start_.distortion_model = "plumb_bob";
    start_.distortion.clear();  // zeros, however many
  }
  if (start_.distortion.empty()) {
    start_.distortion.resize(start_.distortion_model == "plumb_bob" ? 5 : 8);
  }
  std::copy(start_.distortion.begin(), start_.distortion.end(), coefficients_.begin());
}

CameraParameters CalibratingCamera::moved(const CalibrationStep& step) const {
  CameraParameters p = start_;
  const double scale = std::exp(step[0]);
  p.fx *= scale;
  p.fy *= scale;
  p.cx += step[1];
  p.cy += step[2];
  for (int i = 0; i < 2; ++i) p.distortion[i] += step[3 + i];
  return p;
}

bool CalibratingCamera::project(const CalibrationStep& step, const Eigen::Vector3d& x_in_camera,
                                Eigen::Vector2d* pixel, Eigen::Matrix<double, 2, 3>* by_point,
                                Eigen::Matrix<double, 2, kCalibrationParameters>* by_step) const {
  DistortionCoefficients c = coefficients_;
  for (int i = 0; i < 2; ++i) c[i] += step[3 + i];
  Eigen::Vector2d distorted, by_k1;
  double squared = 0;  // of the radius, or the angle
  if (is_equidistant_) {
    if (!equidistant::project(c, M_PI, x_in_camera, &distorted, by_point)) return false;
    const Eigen::Vector2d xy = x_in_camera.head<2>();
    const double rho = xy.norm(), theta = std::atan2(rho, x_in_camera.z());
    squared = theta * theta;
    by_k1 = rho > 0 ? Eigen::Vector2d(xy * (theta * squared / rho)) : Eigen::Vector2d::Zero();
  } else {
    if (!(x_in_camera.z() > 0)) return false;
    const Eigen::Vector2d plane = x_in_camera.hnormalized();
    Eigen::Matrix2d by_plane;
    distorted = polynomial::distort(c, plane, &by_plane);
    *by_point << by_plane / x_in_camera.z(), -by_plane * plane / x_in_camera.z();
    squared = plane.squaredNorm();
    by_k1 = plane * (squared / (1 + squared * (c[5] + squared * (c[6] + squared * c[7]))));
  }
  const double scale = std::exp(step[0]);
  const Eigen::Vector2d focal(scale * start_.fx, scale * start_.fy);
  const Eigen::Vector2d from_center = focal.cwiseProduct(distorted);
  *pixel = from_center + Eigen::Vector2d(start_.cx + step[1], start_.cy + step[2]);
  *by_point = (focal.asDiagonal() * *by_point).eval();
  by_step->col(0) = from_center;
  by_step->middleCols<2>(1).setIdentity();
  by_step->col(3) = focal.cwiseProduct(by_k1);
  by_step->col(4) = squared * by_step->col(3);
  return pixel->allFinite();
}

}  // namespace mono_pose_tracker
