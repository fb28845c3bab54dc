#include "camera/distortion.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/Polynomials>
#include <vector>

namespace mono_pose_tracker {
namespace {

/// Smallest positive real root, or infinity. Coefficients from the constant term upwards.
double smallest_positive_root(Eigen::VectorXd polynomial) {
  Eigen::Index size = polynomial.size();
  while (size > 0 && polynomial[size - 1] == 0) --size;
  double smallest = std::numeric_limits<double>::infinity();
  if (size < 2) return smallest;
  polynomial.conservativeResize(size);
  const Eigen::PolynomialSolver<double, Eigen::Dynamic> solver(polynomial);
  for (const std::complex<double>& root : solver.roots()) {
    // A pair that is complex by rounding only is a double root: the polynomial touches zero, which ends the
    // range too.
    const bool is_real = std::abs(root.imag()) <= 1e-9 * std::abs(root.real());
    if (is_real && root.real() > 0) smallest = std::min(smallest, root.real());
  }
  return smallest;
}

/// Solves f(r) = target for f that grows on [0, end], f(0) = 0: Newton's method kept inside a bracket.
/// `value` returns f and writes f'. Returns `end` when f does not reach the target.
template <typename Function>
double solve_growing(const Function& value, double target, double end) {
  double slope = 0;
  if (!(value(end, &slope) > target)) return end;
  double low = 0, high = end;
  double r = std::min(target, end);
  for (int i = 0; i < 100; ++i) {  // bisection alone needs 63 from 1e3 down to 1e-16
    const double error = value(r, &slope) - target;
    (error > 0 ? high : low) = r;
    double next = r - error / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-14 * r) return next;
    r = next;
  }
  return r;
}

}  // namespace

namespace polynomial {
namespace {

struct Radial {
  double factor, derivative;  // of the radius' factor, by s = radius^2
};

Radial radial(const DistortionCoefficients& c, double s) {
  const double n = 1 + s * (c[0] + s * (c[1] + s * c[4]));
  const double d = 1 + s * (c[5] + s * (c[6] + s * c[7]));
  const double dn = c[0] + s * (2 * c[1] + s * 3 * c[4]);
  const double dd = c[5] + s * (2 * c[6] + s * 3 * c[7]);
  return {n / d, (dn * d - n * dd) / (d * d)};
}

Eigen::VectorXd product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(a.size() + b.size() - 1);
  for (Eigen::Index i = 0; i < a.size(); ++i) result.segment(i, b.size()) += a[i] * b;
  return result;
}

}  // namespace

double max_radius(const DistortionCoefficients& c) {
  // With s = r^2: d(r N(s) / D(s)) / dr = ((N + 2 s N') D - 2 s N D') / D^2.
  const Eigen::Vector4d n(1, c[0], c[1], c[4]);
  const Eigen::Vector4d d(1, c[5], c[6], c[7]);
  const Eigen::Vector4d n_by_r(n[0], 3 * n[1], 5 * n[2], 7 * n[3]);
  const Eigen::Vector4d two_s_d_by_s(0, 2 * d[1], 4 * d[2], 6 * d[3]);
  const Eigen::VectorXd slope = product(n_by_r, d) - product(n, two_s_d_by_s);
  const double s = std::min(smallest_positive_root(slope), smallest_positive_root(d));
  // 1e3 is 0.06 degrees from the plane z = 0: no pinhole camera has a pixel there.
  return std::min(std::sqrt(s), 1e3);
}

Eigen::Vector2d distort(const DistortionCoefficients& c, const Eigen::Vector2d& plane,
                        Eigen::Matrix2d* by_plane) {
  const double x = plane.x(), y = plane.y(), s = plane.squaredNorm();
  const double p1 = c[2], p2 = c[3];
  const Radial r = radial(c, s);
  if (by_plane) {
    const double mixed = 2 * x * y * r.derivative + 2 * p1 * x + 2 * p2 * y;
    *by_plane << r.factor + 2 * x * x * r.derivative + 2 * p1 * y + 6 * p2 * x, mixed,  //
        mixed, r.factor + 2 * y * y * r.derivative + 6 * p1 * y + 2 * p2 * x;
  }
  return {x * r.factor + 2 * p1 * x * y + p2 * (s + 2 * x * x),
          y * r.factor + p1 * (s + 2 * y * y) + 2 * p2 * x * y};
}

Eigen::Vector2d undistort(const DistortionCoefficients& c, double max_radius,
                          const Eigen::Vector2d& distorted) {
  const double distorted_radius = distorted.norm();
  if (!(distorted_radius > 0)) return distorted;
  // The radial part alone first: it is the bulk of the distortion, and one growing function.
  const double radius = solve_growing(
      [&c](double r, double* slope) {
        const Radial at = radial(c, r * r);
        *slope = at.factor + 2 * r * r * at.derivative;
        return r * at.factor;
      },
      distorted_radius, max_radius);
  const Eigen::Vector2d start = distorted * (radius / distorted_radius);
  Eigen::Vector2d plane = start;
  for (int i = 0; i < 10;
       ++i) {  // converges quadratically from an error of the size of p1, p2: 3 or 4 are usual
    Eigen::Matrix2d by_plane;
    const Eigen::Vector2d error = distort(c, plane, &by_plane) - distorted;
    const Eigen::Vector2d step = by_plane.inverse() * error;
    plane -= step;
    if (!(step.squaredNorm() > 1e-26)) break;
  }
  // At the end of the trusted range the derivative is singular, and Newton may leave: the radial solution
  // stands.
  return plane.squaredNorm() <= max_radius * max_radius ? plane : start;
}

}  // namespace polynomial

namespace equidistant {
namespace {

double distorted_radius(const DistortionCoefficients& c, double theta, double* slope) {
  const double s = theta * theta;
  *slope = 1 + s * (3 * c[0] + s * (5 * c[1] + s * (7 * c[2] + s * 9 * c[3])));
  return theta * (1 + s * (c[0] + s * (c[1] + s * (c[2] + s * c[3]))));
}

}  // namespace

double max_angle(const DistortionCoefficients& c) {
  Eigen::VectorXd slope(5);
  slope << 1, 3 * c[0], 5 * c[1], 7 * c[2], 9 * c[3];
  return std::min(std::sqrt(smallest_positive_root(slope)), M_PI);
}

bool project(const DistortionCoefficients& c, double max_angle, const Eigen::Vector3d& x_in_camera,
             Eigen::Vector2d* distorted, Eigen::Matrix<double, 2, 3>* by_point) {
  const Eigen::Vector2d xy = x_in_camera.head<2>();
  const double z = x_in_camera.z();
  const double rho = xy.norm(), squared = rho * rho + z * z;
  if (!(squared > 0)) return false;
  const double theta = std::atan2(rho, z);
  if (!(theta <= max_angle) || theta >= M_PI) return false;
  // On the axis the model is a pinhole to second order; the formulas below divide by rho.
  if (rho < 1e-9 * z) {
    *distorted = xy / z;
    if (by_point) *by_point << 1 / z, 0, -xy.x() / (z * z), 0, 1 / z, -xy.y() / (z * z);
    return true;
  }
  double slope = 0;
  const double radius = distorted_radius(c, theta, &slope);
  const Eigen::Vector2d direction = xy / rho;
  *distorted = direction * radius;
  if (by_point) {
    const Eigen::Vector2d across(-direction.y(), direction.x());
    by_point->leftCols<2>() = direction * direction.transpose() * (slope * z / squared) +
                              across * across.transpose() * (radius / rho);
    by_point->col(2) = -direction * (slope * rho / squared);
  }
  return true;
}

Eigen::Vector3d bearing(const DistortionCoefficients& c, double max_angle, const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (!std::isfinite(radius)) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  if (radius == 0) return Eigen::Vector3d::UnitZ();
  const double theta = solve_growing(
      [&c](double angle, double* slope) { return distorted_radius(c, angle, slope); }, radius, max_angle);
  const Eigen::Vector2d xy = distorted * (std::sin(theta) / radius);
  return {xy.x(), xy.y(), std::cos(theta)};
}

}  // namespace equidistant

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
