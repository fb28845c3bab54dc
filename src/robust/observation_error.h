#pragma once

#include <Eigen/Core>
#include <functional>

#include "levenberg_marquardt.h"
#include "robust/similarity.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

using SimilarityEquations = NormalEquations<kSimilarityParameters>;

// Where one map has a point against another's sight of it, relative to the distance: across the sight by the
// angle, along it by the logarithm of the ratio. It counts by its covariance: that of a bearing, and what
// either map does not know of the point's depth along its own sight, which the other, from aside, sees
// across.
class ObservationError {
 public:
  // x and other_center (the camera that saw it there) are the other map's, in this one; both depth_sigma are
  // finite. sigma: of a bearing, rad.
  ObservationError(const ObservedPoint& observation, const Eigen::Vector3d& x,
                   const Eigen::Vector3d& other_center, double other_depth_sigma, double sigma);

  // sigma^2 times the squared Mahalanobis distance: that of an angle as unlikely, rad^2; 1 behind the camera.
  double squared() const { return squared_; }

  // The squared error's half as normal equations. dx(x): derivative of a point of the other map, given in
  // this one, by the step. The step turns what is not known of the other's depth with its point, so the
  // gradient is that at the point freed of the depth error which is likeliest by this sight (total least
  // squares); at the noisy point products of noise would not average out, and shrink the turn.
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
