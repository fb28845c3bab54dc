#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace mono_pose_tracker {

enum class DistortionModel { kNone, kPlumbBob, kRationalPolynomial, kEquidistant };

/// The fields of a calibration, as in sensor_msgs/CameraInfo and the YAML of camera_calibration.
struct CameraParameters {
  int width = 0;                               // px
  int height = 0;                              // px
  double fx = 0, fy = 0, cx = 0, cy = 0;       // px; the centre of the first pixel is (0, 0)
  std::string distortion_model = "plumb_bob";  // "", plumb_bob, rational_polynomial, equidistant
  std::vector<double> distortion;              // k1 k2 p1 p2 k3 [k4 k5 k6] or the four of equidistant

  bool operator==(const CameraParameters& other) const;
  bool operator!=(const CameraParameters& other) const { return !(*this == other); }
};

/// Maps pixels to unit bearings and back. Camera axes are optical: x right, y down, z forward.
class CameraModel {
 public:
  CameraModel() = default;
  /// Throws std::invalid_argument, naming the field, its value and what was expected, on parameters of no
  /// camera.
  explicit CameraModel(const CameraParameters& parameters);

  const CameraParameters& parameters() const { return parameters_; }
  int width() const { return parameters_.width; }
  int height() const { return parameters_.height; }

  /// Unit bearing of a pixel, distortion removed (to 1e-9 px). A pixel beyond what the distortion polynomial
  /// can reach gets the bearing at the end of the trusted range in its direction.
  Eigen::Vector3d bearing(const Eigen::Vector2d& pixel) const;

  /// Pixel of a point in the camera's frame, distortion applied. False (pixel untouched) when the point is
  /// behind the camera or outside the trusted range of the distortion polynomial (where it grows with the
  /// radius). An equidistant camera may cover more than 90 degrees, so z > 0 is not required there.
  bool project(const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel) const;

  /// As project, with d pixel / d x_in_camera.
  bool project(const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* jacobian) const;

  bool in_image(const Eigen::Vector2d& pixel, double margin_px = 0) const {
    return pixel.x() >= margin_px - 0.5 && pixel.y() >= margin_px - 0.5 &&
           pixel.x() < width() - 0.5 - margin_px && pixel.y() < height() - 0.5 - margin_px;
  }

  /// Mean focal length in px: one pixel is 1 / focal() radians at the image centre.
  double focal() const { return 0.5 * (parameters_.fx + parameters_.fy); }

 private:
  CameraParameters parameters_;
  DistortionModel model_ = DistortionModel::kNone;
  std::array<double, 8> coefficients_{};  // the parameters' distortion, zero-padded
  double max_radius_ = 0;  // of the undistorted normalised plane (equidistant: the angle in radians)
};

/// Factor for thresholds given "at 640 px": the longer side of the image [px] over 640, at least 1. The
/// longer side makes portrait and landscape images equal.
inline double image_scale(int width, int height) { return std::max(1.0, std::max(width, height) / 640.0); }

inline double image_scale(const CameraModel& camera) { return image_scale(camera.width(), camera.height()); }

/// px: what radii given as a share of the image are a share of, for the same reason.
inline int longer_side(const CameraModel& camera) { return std::max(camera.width(), camera.height()); }

}  // namespace mono_pose_tracker
