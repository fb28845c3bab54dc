#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/scene.h"

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

/// A ray has hit when it is this near the surface (m): a ten thousandth of a pixel at arm's length.
constexpr double kHitDistance = 1e-7;

/// Bounding ball of an object that is given by a lower bound of the distance to its surface.
struct Ball {
  Eigen::Vector3d centre;
  double radius;  // m
};

/// Where a ray leaves the ball, m; -1 when it misses it.
inline double end_of_ball(const Ball& ball, const Ray& ray) {
  const Eigen::Vector3d to_centre = ball.centre - ray.origin;
  const double along = to_centre.dot(ray.direction);
  const double off_squared = to_centre.squaredNorm() - along * along;
  const double radius_squared = ball.radius * ball.radius;
  return off_squared > radius_squared ? -1 : along + std::sqrt(radius_squared - off_squared);
}

/// The zero between `outside` (field > 0) and `inside` (field < 0) by the Illinois variant of false position.
template <class Field>
double bracketed_zero(const Field& field_at, const Ray& ray, double outside, double field_outside,
                      double inside, double field_inside) {
  double t = inside;
  for (int i = 0; i < 60; ++i) {
    t = (outside * field_inside - inside * field_outside) / (field_inside - field_outside);
    const double field = field_at(ray.origin + t * ray.direction);
    if (std::fabs(field) < kHitDistance) break;
    if (field > 0) {
      outside = t;
      field_outside = field;
      field_inside *= 0.5;
    } else {
      inside = t;
      field_inside = field;
      field_outside *= 0.5;
    }
  }
  return t;
}

/// Steps along a ray from `start` to `end` (m) to where `field_at(x)`, a lower bound of the distance to the
/// surface that is exact at 0 and may err by a tenth where parts blend, is zero (Hart 1996). -1 when it is
/// not.
template <class Field>
double march(const Field& field_at, const Ray& ray, double start, double end) {
  double t = start, previous = start, field_before = 0;
  for (int i = 0; i < 400 && t < end; ++i) {
    const double field = field_at(ray.origin + t * ray.direction);
    if (field < kHitDistance) {
      const bool crossed = field < 0 && i > 0;
      return crossed ? bracketed_zero(field_at, ray, previous, field_before, t, field) : t;
    }
    // Within 2 mm of the surface, thinner than anything here, a step goes where the field would be zero at
    // the rate it falls: past it by a little, which brackets the zero.
    const double rate = i > 0 ? (field_before - field) / (t - previous) : 1;
    previous = t;
    field_before = field;
    t += field > 2e-3 ? 0.9 * field : field / std::clamp(rate, 0.25, 1.0) + kHitDistance;
  }
  return -1;
}

/// Scene::free_distance of an object within the ball.
template <class Field>
double march_cone(const Field& field_at, const Ball& ball, const Ray& axis, double slope) {
  const double end = (ball.centre - axis.origin).norm() + ball.radius;
  double t = 0;
  for (int i = 0; i < 100; ++i) {
    const double clearance = field_at(axis.origin + t * axis.direction) - t * slope;
    if (clearance < 1e-3) return t;
    t += 0.9 * clearance / (1 + slope);
    if (t > end) return std::numeric_limits<double>::infinity();
  }
  return t;
}

/// Outward unit normal of a field's surface: differences over four corners of a tetrahedron. 10 um is far
/// below any curvature radius and far above rounding.
template <class Field>
Eigen::Vector3d field_normal(const Field& field_at, const Eigen::Vector3d& x) {
  constexpr double h = 1e-5;
  const Eigen::Vector3d a(1, -1, -1), b(-1, -1, 1), c(-1, 1, -1), d(1, 1, 1);
  return (a * field_at(x + h * a) + b * field_at(x + h * b) + c * field_at(x + h * c) +
          d * field_at(x + h * d))
      .normalized();
}

/// Scene::intersect of an object within the ball, except for the number of the surface.
template <class Field>
bool intersect_field(const Field& field_at, const Ball& ball, const Ray& ray, double start, Hit* hit) {
  const double distance = march(field_at, ray, start, end_of_ball(ball, ray));
  if (distance < 0) return false;
  hit->distance = distance;
  hit->normal_in_map = field_normal(field_at, ray.origin + distance * ray.direction);
  return true;
}

}  // namespace mono_pose_tracker
