#include "mono_pose_tracker/simulation/head_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mono_pose_tracker/simulation/head_shape.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

/// A ray has hit when it is this near the surface (m): a ten thousandth of a pixel at arm's length.
constexpr double kHitDistance = 1e-7;

/// Beyond this a ray has left the ball that holds the head.
double end_of_head(const Ray& ray) {
  const Vector3d to_centre = head_bound_centre() - ray.origin;
  const double along = to_centre.dot(ray.direction);
  const double off_squared = to_centre.squaredNorm() - along * along;
  constexpr double kRadiusSquared = kHeadBoundRadius * kHeadBoundRadius;
  return off_squared > kRadiusSquared ? -1 : along + std::sqrt(kRadiusSquared - off_squared);
}

/// The zero between `outside` (field > 0) and `inside` (field < 0) by the Illinois variant of false position.
double bracketed_zero(const Ray& ray, double outside, double field_outside, double inside,
                      double field_inside) {
  double t = inside;
  for (int i = 0; i < 60; ++i) {
    t = (outside * field_inside - inside * field_outside) / (field_inside - field_outside);
    const double field = head_distance(ray.origin + t * ray.direction);
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

}  // namespace

bool HeadScene::intersect(const Ray& ray, double start, Hit* hit) const {
  const double end = end_of_head(ray);
  double t = start, previous = start, field_before = 0;
  for (int i = 0; i < 400 && t < end; ++i) {
    const double field = head_distance(ray.origin + t * ray.direction);
    const bool crossed = field < 0 && i > 0;
    if (field < kHitDistance) {
      hit->distance = crossed ? bracketed_zero(ray, previous, field_before, t, field) : t;
      hit->normal_in_map = head_normal(ray.origin + hit->distance * ray.direction);
      hit->surface = 0;
      return true;
    }
    // The field is a lower bound of the distance but where parts blend, which a tenth less allows for. Within
    // 2 mm of the surface, thinner than anything of the head, a step goes where the field would be zero at
    // the rate it falls: past it by a little, which brackets the zero.
    const double rate = i > 0 ? (field_before - field) / (t - previous) : 1;
    previous = t;
    field_before = field;
    t += field > 2e-3 ? 0.9 * field : field / std::clamp(rate, 0.25, 1.0) + kHitDistance;
  }
  return false;
}

double HeadScene::free_distance(const Ray& axis, double slope) const {
  const double end = (head_bound_centre() - axis.origin).norm() + kHeadBoundRadius;
  double t = 0;
  for (int i = 0; i < 100; ++i) {
    const double clearance = head_distance(axis.origin + t * axis.direction) - t * slope;
    if (clearance < 1e-3) return t;
    t += 0.9 * clearance / (1 + slope);
    if (t > end) return std::numeric_limits<double>::infinity();
  }
  return t;
}

Color HeadScene::albedo(const Hit&, const Vector3d& x_in_map, float footprint) const {
  return head_albedo(seed_, x_in_map.cast<float>(), footprint);
}

Color HeadScene::irradiance(const Hit& hit, const Vector3d& x_in_map, const Lighting& lighting) const {
  const Eigen::Vector3f normal = hit.normal_in_map.cast<float>();
  // Light goes a little way through skin: the edge of the shadow lies beyond the horizon.
  const float key = std::max(0.f, (normal.dot(lighting.key_direction_in_map) + 0.3f) / 1.3f);
  const float fill = 0.5f + 0.5f * normal.dot(lighting.fill_direction_in_map);
  // Hollows see less of the surroundings: the free distance a finger's breadth off the surface tells how
  // much.
  constexpr double kBreadth = 0.015;
  const double free = head_distance(x_in_map + kBreadth * hit.normal_in_map) / kBreadth;
  const float open = 0.35f + 0.65f * static_cast<float>(std::clamp(free, 0.0, 1.0));
  return Color(1.0f, 0.98f, 0.95f) * (0.92f * key * (0.4f + 0.6f * open)) +
         Color(0.95f, 0.98f, 1.0f) * (0.48f * fill * open);
}

}  // namespace mono_pose_tracker
