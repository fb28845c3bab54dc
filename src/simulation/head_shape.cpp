#include "mono_pose_tracker/simulation/head_shape.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

double sphere(const Vector3d& p, const Vector3d& centre, double radius) {
  return (p - centre).norm() - radius;
}

struct Ellipsoid {
  Ellipsoid(const Vector3d& c, const Vector3d& radii) : centre(c), inverse_radii(radii.cwiseInverse()) {}
  Vector3d centre, inverse_radii;
};

const Ellipsoid kCranium({0, -0.025, 0.012}, {0.076, 0.092, 0.098});
const Ellipsoid kMidface({0, 0.030, -0.018}, {0.063, 0.085, 0.074});
const Ellipsoid kJaw({0, 0.066, -0.030}, {0.056, 0.050, 0.056});
const Ellipsoid kBrow({0.027, -0.021, -0.080}, {0.026, 0.007, 0.011});
const Ellipsoid kUpperLip({0, 0.0665, -0.083}, {0.024, 0.0065, 0.010});
const Ellipsoid kLowerLip({0, 0.0770, -0.081}, {0.020, 0.0075, 0.010});
const Ellipsoid kEar({0, 0, 0}, {0.009, 0.032, 0.020});

/// First-order distance F / |grad F| of the convex F = |p / radii| - 1: outside never more than the distance.
double ellipsoid(const Vector3d& p, const Ellipsoid& e) {
  const Vector3d scaled = (p - e.centre).cwiseProduct(e.inverse_radii);
  const double norm = scaled.norm();
  const double gradient = scaled.cwiseProduct(e.inverse_radii).norm();
  return gradient > 0 ? (norm - 1) * norm / gradient : -1 / e.inverse_radii.maxCoeff();
}

/// A capsule whose radius goes from radius_a at a to radius_b at b.
double tapered_capsule(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a,
                       double radius_b) {
  const Vector3d axis = b - a;
  const double s = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  // The taper steepens the field by a few per cent; the march's step factor allows for it.
  return (p - a - s * axis).norm() - (radius_a + s * (radius_b - radius_a));
}

/// The lesser of two distances, the edge between them rounded over about `width` metres.
double blend(double a, double b, double width) {
  const double h = std::max(width - std::fabs(a - b), 0.0) / width;
  return std::min(a, b) - 0.25 * width * h * h;
}

double carve(double a, double hole, double width) { return -blend(-a, hole, width); }

double skull(const Vector3d& p) {
  double d = ellipsoid(p, kCranium);
  d = blend(d, ellipsoid(p, kMidface), 0.03);
  d = blend(d, ellipsoid(p, kJaw), 0.03);
  d = blend(d, tapered_capsule(p, {0, 0.06, 0.030}, {0, 0.30, 0.050}, 0.052, 0.078), 0.04);
  return d;
}

double face(const Vector3d& p, double d) {
  d = blend(d, sphere(p, {0, 0.101, -0.070}, 0.018), 0.03);
  d = blend(d, sphere(p, {0.041, 0.028, -0.060}, 0.024), 0.04);
  d = blend(d, ellipsoid(p, kBrow), 0.025);
  d = carve(d, sphere(p, {0.033, 0.002, -0.110}, 0.019), 0.015);
  d = blend(d, sphere(p, {0.032, 0.003, -0.0775}, 0.0140), 0.004);
  d = blend(d, tapered_capsule(p, {0, -0.012, -0.085}, {0, 0.036, -0.110}, 0.007, 0.0105), 0.014);
  d = blend(d, sphere(p, {0.0110, 0.0405, -0.0985}, 0.0075), 0.010);
  d = blend(d, ellipsoid(p, kUpperLip), 0.008);
  d = blend(d, ellipsoid(p, kLowerLip), 0.007);
  return d;
}

double ear(const Vector3d& p) {
  // Flared 25 degrees from the skull.
  constexpr double c = 0.906, s = 0.423;
  const Vector3d q = p - Vector3d(0.080, 0.012, 0.020);
  const Vector3d r(c * q.x() - s * q.z(), q.y(), s * q.x() + c * q.z());
  const double shell = ellipsoid(r, kEar);
  return carve(shell, sphere(r, {0.013, 0.002, -0.002}, 0.0125), 0.005);
}

}  // namespace

double head_distance(const Vector3d& x_in_head) {
  const double outside = (x_in_head - head_bound_centre()).norm() - kHeadBoundRadius;
  if (outside > 0.05) return outside;
  // Left and right are alike. Smooth over 3 mm at the middle, where a plain |x| would leave a crease.
  const Vector3d p(std::sqrt(x_in_head.x() * x_in_head.x() + 9e-6), x_in_head.y(), x_in_head.z());
  double d = skull(p);
  // Parts far enough not to reach the skull here by their blend (its width: 0.03 m and 0.008 m) count by a
  // ball around them; a blended surface stands out from both parts by a quarter of the width at most.
  const double to_face = sphere(p, {0, 0.035, -0.070}, 0.09);
  d = to_face < 0.03 ? face(p, d) : std::min(d, to_face - 0.008);
  const double to_ear = sphere(p, {0.082, 0.012, 0.020}, 0.036);
  return to_ear < 0.03 ? blend(d, ear(p), 0.008) : std::min(d, to_ear - 0.002);
}

Vector3d head_normal(const Vector3d& x) {
  // Differences over four corners of a tetrahedron; 10 um is far below any curvature radius and far above
  // rounding.
  constexpr double h = 1e-5;
  const Vector3d a(1, -1, -1), b(-1, -1, 1), c(-1, 1, -1), d(1, 1, 1);
  return (a * head_distance(x + h * a) + b * head_distance(x + h * b) + c * head_distance(x + h * c) +
          d * head_distance(x + h * d))
      .normalized();
}

}  // namespace mono_pose_tracker
