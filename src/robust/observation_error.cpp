#include "observation_error.h"

#include <Eigen/Dense>
#include <cmath>

namespace mono_pose_tracker {

ObservationError::ObservationError(const ObservedPoint& observation, const Eigen::Vector3d& x,
                                   const Eigen::Vector3d& other_center, double other_depth_sigma,
                                   double sigma)
    : x_(x), bearing_(observation.bearing) {
  const Eigen::Vector3d p = x - observation.center;
  if (!(p.dot(bearing_) > 0)) return;
  distance_ = p.norm();
  direction_ = p / distance_;
  error_ =
      direction_ - bearing_ + std::log(distance_ / (observation.x - observation.center).norm()) * bearing_;
  own_noise_ = observation.depth_sigma / sigma * bearing_;
  other_noise_ = other_depth_sigma / sigma / distance_ * (x - other_center);
  squared_ = error_.dot(weighed_error());
}

// The inverse of I + nn' + mm' (n, m: own and other noise), all terms of one sign: computed as an inverse it
// has no digits left where both are long and nearly parallel.
Eigen::Matrix3d ObservationError::weight() const {
  const auto square = [](const Eigen::Vector3d& v) -> Eigen::Matrix3d { return v * v.transpose(); };
  const auto square_across = [&](const Eigen::Vector3d& v) -> Eigen::Matrix3d {
    return v.squaredNorm() * Eigen::Matrix3d::Identity() - square(v);
  };
  return (Eigen::Matrix3d::Identity() + square_across(own_noise_) + square_across(other_noise_) +
          square(own_noise_.cross(other_noise_))) /
         determinant();
}

// Times the error, in an order that cancels nothing either.
Eigen::Vector3d ObservationError::weighed_error() const {
  const Eigen::Vector3d &n = own_noise_, &m = other_noise_, &e = error_, q = n.cross(m);
  return (e + n.cross(e).cross(n) + m.cross(e).cross(m) + q.dot(e) * q) / determinant();
}

double ObservationError::determinant() const {
  return 1 + own_noise_.squaredNorm() + other_noise_.squaredNorm() +
         own_noise_.cross(other_noise_).squaredNorm();
}

void ObservationError::add_to(SimilarityEquations* equations,
                              const std::function<PointDerivative(const Eigen::Vector3d&)>& dx) const {
  const Eigen::Matrix<double, 1, kSimilarityParameters> farther =
      direction_.transpose() * dx(x_) / distance_;  // relative
  const Eigen::Vector3d weighed = weighed_error();
  const double likeliest = other_noise_.dot(weighed);  // depth error, in standard deviations
  const PointDerivative dx_freed = dx(x_ - distance_ * likeliest * other_noise_);
  const PointDerivative j = dx_freed / distance_ + (bearing_ - direction_) * farther;
  equations->information += j.transpose() * weight() * j;
  // Farther away the noise is less of the distance.
  equations->gradient += j.transpose() * weighed + likeliest * likeliest * farther.transpose();
}

}  // namespace mono_pose_tracker
