#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

using DistortionCoefficients = std::array<double, 8>;

/// The model of plumb_bob and, with k4 k5 k6, rational_polynomial (OpenCV's calib3d), on the normalised plane
/// z = 1: coefficients k1 k2 p1 p2 k3 k4 k5 k6.
namespace polynomial {

/// Radius up to which the distorted radius grows with the undistorted one; beyond it two points share a
/// pixel.
double max_radius(const DistortionCoefficients& c);

/// Distorted point of an undistorted one, and its derivative when asked for.
Eigen::Vector2d distort(const DistortionCoefficients& c, const Eigen::Vector2d& plane,
                        Eigen::Matrix2d* by_plane);

/// Inverse of distort within max_radius.
Eigen::Vector2d undistort(const DistortionCoefficients& c, double max_radius,
                          const Eigen::Vector2d& distorted);

}  // namespace polynomial

/// The fisheye model of Kannala and Brandt (PAMI 2006) as in OpenCV's fisheye: the distorted radius is
/// theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), theta the angle from the optical axis in
/// radians.
namespace equidistant {

/// Angle up to which the distorted radius grows with it; at most pi.
double max_angle(const DistortionCoefficients& c);

/// False when the point is at an angle beyond max_angle or at the camera's centre.
bool project(const DistortionCoefficients& c, double max_angle, const Eigen::Vector3d& x_in_camera,
             Eigen::Vector2d* distorted, Eigen::Matrix<double, 2, 3>* by_point);

/// Unit bearing of a distorted point.
Eigen::Vector3d bearing(const DistortionCoefficients& c, double max_angle, const Eigen::Vector2d& distorted);

}  // namespace equidistant

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
