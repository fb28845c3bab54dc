#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

/// Lower bounds of the distance (m) to simple solids, negative inside, zero exactly on the surface, and ways
/// to join them (Hart 1996; Quilez).

inline double sphere(const Eigen::Vector3d& p, const Eigen::Vector3d& centre, double radius) {
  return (p - centre).norm() - radius;
}

struct Ellipsoid {
  Ellipsoid(const Eigen::Vector3d& c, const Eigen::Vector3d& radii)
      : centre(c), inverse_radii(radii.cwiseInverse()) {}
  Eigen::Vector3d centre, inverse_radii;
};

/// First-order distance F / |grad F| of the convex F = |p / radii| - 1: outside never more than the distance.
inline double ellipsoid(const Eigen::Vector3d& p, const Ellipsoid& e) {
  const Eigen::Vector3d scaled = (p - e.centre).cwiseProduct(e.inverse_radii);
  const double norm = scaled.norm();
  const double gradient = scaled.cwiseProduct(e.inverse_radii).norm();
  return gradient > 0 ? (norm - 1) * norm / gradient : -1 / e.inverse_radii.maxCoeff();
}

/// A capsule whose radius goes from radius_a at a to radius_b at b.
inline double tapered_capsule(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              double radius_a, double radius_b) {
  const Eigen::Vector3d axis = b - a;
  const double s = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  // The taper steepens the field by a few per cent; the march's step factor allows for it.
  return (p - a - s * axis).norm() - (radius_a + s * (radius_b - radius_a));
}

/// A disc of this thickness lying level (y down), its upper side at y = top.
inline double flat_cylinder(const Eigen::Vector3d& p, double top, double radius, double thickness) {
  const double side = std::hypot(p.x(), p.z()) - radius;
  const double level = std::fabs(p.y() - top - 0.5 * thickness) - 0.5 * thickness;
  return std::min(std::max(side, level), 0.0) + std::hypot(std::max(side, 0.0), std::max(level, 0.0));
}

/// The lesser of two distances, the edge between them rounded over about `width` metres.
inline double blend(double a, double b, double width) {
  const double h = std::max(width - std::fabs(a - b), 0.0) / width;
  return std::min(a, b) - 0.25 * width * h * h;
}

inline double carve(double a, double hole, double width) { return -blend(-a, hole, width); }

}  // namespace mono_pose_tracker
