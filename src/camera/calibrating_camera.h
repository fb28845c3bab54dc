#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Parameters of the calibration refinement: the logarithm of both focal lengths (their ratio is fixed), the
/// principal point (px), and the first two radial distortion coefficients.
constexpr int kCalibrationParameters = 5;
using CalibrationStep = Eigen::Matrix<double, kCalibrationParameters, 1>;  // log f, cx, cy, k1, k2

/// A camera with unknown parameters: projects points for any step from its initial parameters, and returns
/// the derivatives of the pixels. An undistorted camera gets the plumb_bob model.
class CalibratingCamera {
 public:
  explicit CalibratingCamera(const CameraParameters& start);

  CameraParameters moved(const CalibrationStep& step) const;

  /// False (nothing written) behind the camera. The trusted range of the distortion is not checked here: the
  /// final parameters must make a CameraModel that covers its whole image.
  bool project(const CalibrationStep& step, const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* by_point,
               Eigen::Matrix<double, 2, kCalibrationParameters>* by_step) const;

 private:
  CameraParameters start_;
  bool is_equidistant_ = false;
  std::array<double, 8> coefficients_{};  // the parameters' distortion, zero-padded
};

}  // namespace mono_pose_tracker
