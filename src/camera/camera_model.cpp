#include "mono_pose_tracker/camera/camera_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "distortion.h"

namespace mono_pose_tracker {
namespace {

[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& expected) {
  throw std::invalid_argument(field + " is " + value + ": expected " + expected);
}

std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

void check_numbers(const CameraParameters& p) {
  if (p.width <= 0) refuse("width", std::to_string(p.width), "a positive number of pixels");
  if (p.height <= 0) refuse("height", std::to_string(p.height), "a positive number of pixels");
  for (const auto& [name, value] : {std::pair("fx", p.fx), std::pair("fy", p.fy)}) {
    if (!(value > 0) || !std::isfinite(value)) {
      refuse(name, text(value), "a positive focal length in px (an uncalibrated camera reports zero)");
    }
  }
  for (const auto& [name, value] : {std::pair("cx", p.cx), std::pair("cy", p.cy)}) {
    if (!std::isfinite(value)) refuse(name, text(value), "a finite number of pixels");
  }
  for (double value : p.distortion) {
    if (!std::isfinite(value)) refuse("distortion", text(value), "finite coefficients");
  }
}

bool all_zero(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

/// The lengths that the model's coefficients may have, the usual one last; none of a model that is not known.
std::vector<std::size_t> lengths_of(const std::string& model) {
  if (model == "plumb_bob") return {0, 4, 5};
  if (model == "rational_polynomial") return {0, 8};
  if (model == "equidistant") return {4};
  return {};
}

/// Drivers fill D up to a length of their own, and call what they have none of as they like. Zeros beyond the
/// model's coefficients are dropped, and nothing but zeros is no distortion, whatever its name and length
/// (of equidistant: a fisheye lens without further terms).
CameraParameters with_usual_length(CameraParameters p) {
  std::vector<double> d = p.distortion;
  if (p.distortion_model.empty()) return p;
  if (all_zero(d) && lengths_of(p.distortion_model).empty()) p.distortion_model = "plumb_bob";
  const std::vector<std::size_t> lengths = lengths_of(p.distortion_model);
  if (lengths.empty() || std::count(lengths.begin(), lengths.end(), d.size()) > 0) return p;
  if (all_zero(d) && !d.empty()) d.resize(lengths.back());
  while (d.size() > lengths.back() && d.back() == 0) d.pop_back();
  // In OpenCV's order k4, k5 and k6 come last; missing ones are zero.
  if (p.distortion_model == "rational_polynomial" && (d.size() == 4 || d.size() == 5)) d.resize(8);
  // Otherwise it is refused with the length that it has.
  if (std::count(lengths.begin(), lengths.end(), d.size()) > 0) p.distortion = d;
  return p;
}

void check_length(const CameraParameters& p, std::initializer_list<std::size_t> lengths,
                  const char* expected) {
  if (std::find(lengths.begin(), lengths.end(), p.distortion.size()) == lengths.end()) {
    refuse("distortion", "of length " + std::to_string(p.distortion.size()),
           std::string(expected) + " for the distortion model " + p.distortion_model);
  }
}

DistortionModel checked_model(const CameraParameters& p) {
  const bool has_none = all_zero(p.distortion);
  if (p.distortion_model.empty()) {
    if (!has_none)
      refuse("distortion_model", "empty", "a model name, because the distortion coefficients are not zero");
    return DistortionModel::kNone;
  }
  if (p.distortion_model == "plumb_bob") {
    check_length(p, {0, 4, 5}, "4 or 5 coefficients (k1 k2 p1 p2 [k3])");
    return has_none ? DistortionModel::kNone : DistortionModel::kPlumbBob;
  }
  if (p.distortion_model == "rational_polynomial") {
    check_length(p, {0, 8}, "8 coefficients (k1 k2 p1 p2 k3 k4 k5 k6)");
    return has_none ? DistortionModel::kNone : DistortionModel::kRationalPolynomial;
  }
  if (p.distortion_model == "equidistant") {
    check_length(p, {4}, "4 coefficients (k1 k2 k3 k4)");
    return DistortionModel::kEquidistant;
  }
  refuse("distortion_model", "'" + p.distortion_model + "'", "plumb_bob, rational_polynomial or equidistant");
}

}  // namespace

bool CameraParameters::operator==(const CameraParameters& other) const {
  return width == other.width && height == other.height && fx == other.fx && fy == other.fy &&
         cx == other.cx && cy == other.cy && distortion_model == other.distortion_model &&
         distortion == other.distortion;
}

CameraModel::CameraModel(const CameraParameters& parameters) : parameters_(with_usual_length(parameters)) {
  check_numbers(parameters_);
  model_ = checked_model(parameters_);
  // Without a model there may be any number of zeros.
  if (model_ != DistortionModel::kNone) {
    std::copy(parameters_.distortion.begin(), parameters_.distortion.end(), coefficients_.begin());
  }
  max_radius_ = model_ == DistortionModel::kEquidistant ? equidistant::max_angle(coefficients_)
                                                        : polynomial::max_radius(coefficients_);
}

Eigen::Vector3d CameraModel::bearing(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d distorted((pixel.x() - parameters_.cx) / parameters_.fx,
                                  (pixel.y() - parameters_.cy) / parameters_.fy);
  switch (model_) {
    case DistortionModel::kNone:
      return distorted.homogeneous().normalized();
    case DistortionModel::kEquidistant:
      return equidistant::bearing(coefficients_, max_radius_, distorted);
    default:
      return polynomial::undistort(coefficients_, max_radius_, distorted).homogeneous().normalized();
  }
}

bool CameraModel::project(const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel) const {
  return project(x_in_camera, pixel, nullptr);
}

bool CameraModel::project(const Eigen::Vector3d& x_in_camera, Eigen::Vector2d* pixel,
                          Eigen::Matrix<double, 2, 3>* jacobian) const {
  Eigen::Vector2d distorted;
  if (model_ == DistortionModel::kEquidistant) {
    if (!equidistant::project(coefficients_, max_radius_, x_in_camera, &distorted, jacobian)) return false;
  } else {
    if (!(x_in_camera.z() > 0)) return false;
    const Eigen::Vector2d plane = x_in_camera.hnormalized();
    if (!(plane.squaredNorm() <= max_radius_ * max_radius_)) return false;  // also when not a number
    distorted = plane;
    Eigen::Matrix2d by_plane = Eigen::Matrix2d::Identity();
    if (model_ != DistortionModel::kNone) {
      distorted = polynomial::distort(coefficients_, plane, jacobian ? &by_plane : nullptr);
    }
    if (jacobian) {
      const double inverse_z = 1 / x_in_camera.z();
      *jacobian << by_plane * inverse_z, -by_plane * plane * inverse_z;
    }
  }
  if (jacobian) *jacobian = Eigen::Vector2d(parameters_.fx, parameters_.fy).asDiagonal() * *jacobian;
  *pixel << parameters_.fx * distorted.x() + parameters_.cx, parameters_.fy * distorted.y() + parameters_.cy;
  // Coefficients may be finite and yet beyond what a double can hold once they are multiplied.
  return pixel->allFinite();
}

}  // namespace mono_pose_tracker
