#pragma once

#include <Eigen/Core>
#include <functional>

#include "levenberg_marquardt.h"
#include "robust/similarity.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

using SimilarityEquations = NormalEquations<kSimilarityParameters>;

// Error between an observation in one map and the position of the same point in another map, relative to the
// distance: the angle across the viewing ray, and the logarithm of the depth ratio along it. It is weighted
// by its covariance: the bearing noise, and the depth uncertainty of both maps along their own viewing rays.
class ObservationError {
 public:
  // x and other_center (the observing camera) are those of the other map, transformed into this one; both
  // depth_sigma are finite. sigma: of a bearing, rad.
  ObservationError(const ObservedPoint& observation, const Eigen::Vector3d& x,
                   const Eigen::Vector3d& other_center, double other_depth_sigma, double sigma);

  // sigma^2 times the squared Mahalanobis distance: the square of an equally unlikely angle, rad^2; 1 behind
  // the camera.
  double squared() const { return squared_; }

  // Adds half the squared error to the normal equations. dx(x): derivative by the step of a point of the
  // other map, given in this one. The step also rotates the other map's depth uncertainty. The gradient is
  // therefore taken at the point corrected by its most likely depth error (total least squares). At the noisy
  // point, products of noise would not average out and would bias the rotation towards zero.
  void add_to(SimilarityEquations* equations,
              const std::function<PointDerivative(const Eigen::Vector3d&)>& dx) const;

 private:
  Eigen::Vector3d weighed_error() const;
  Eigen::Matrix3d weight() const;  // inverse of the covariance over sigma^2
  double determinant() const;      // of the covariance over sigma^2

  Eigen::Vector3d x_, bearing_;
  double distance_ = 0;
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();  // to x, of length 1
  Eigen::Vector3d error_ = Eigen::Vector3d::Zero();
  // Of depths, from here: a standard deviation, in those of a bearing.
  Eigen::Vector3d own_noise_ = Eigen::Vector3d::Zero(), other_noise_ = Eigen::Vector3d::Zero();
  double squared_ = 1;
};

}  // namespace mono_pose_tracker
