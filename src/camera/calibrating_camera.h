#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// What calibrating moves: the logarithm of both focal lengths (their ratio stays), the principal point (px),
/// and the first two radial coefficients of the distortion.
constexpr int kCalibrationParameters = 5;
using CalibrationStep = Eigen::Matrix<double, kCalibrationParameters, 1>;  // log f, cx, cy, k1, k2

/// A camera whose parameters are unknowns: projects with any step away from where it started, and says how
/// pixels follow. Without distortion so far, that of plumb_bob is what it gets.
class CalibratingCamera {
 public:
  explicit CalibratingCamera(const CameraParameters& start);

  CameraParameters moved(const CalibrationStep& step) const;

  /// False (nothing written) behind the camera. By how much the distortion may be trusted is not asked: moved
  /// parameters must make a CameraModel that sees all of its image.
  bool project(const CalibrationStep& step, const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* by_point,
               Eigen::Matrix<double, 2, kCalibrationParameters>* by_step) const;

 private:
  CameraParameters start_;
  bool is_equidistant_ = false;
  std::array<double, 8> coefficients_{};  // the parameters' distortion, zero-padded
};

}  // namespace mono_pose_tracker
