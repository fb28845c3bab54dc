#include "simulation/turntable_scene.h"

#include <algorithm>

#include "simulation/head_shape.h"
#include "simulation/noise.h"
#include "simulation/ray_march.h"
#include "simulation/skin_light.h"
#include "simulation/solid_parts.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

enum TurntableSurface { kTop, kPlinth };

const Ball kTableBall{{0, 0.36, 0.03}, 0.36};
const Vector3d kAxis(0, 0, 0.03);  // what turns turns about the upright line through here
constexpr double kTopLevel = 0.19, kTopThickness = 0.02, kTopRadius = 0.19;  // m
constexpr double kPlinthLevel = kTopLevel + kTopThickness,
                 kPlinthRadius = 0.15;  // m, above what of the neck is below

double top_distance(const Vector3d& x) {
  return flat_cylinder(x - kAxis, kTopLevel, kTopRadius, kTopThickness);
}

double table_distance(const Vector3d& x) {
  return std::min(top_distance(x), flat_cylinder(x - kAxis, kPlinthLevel, kPlinthRadius, 0.5));
}

}  // namespace

bool TurntableScene::intersect(const Ray& ray, double start, Hit* hit) const {
  if (!intersect_field(table_distance, kTableBall, ray, start, hit)) return false;
  hit->surface = top_distance(ray.origin + hit->distance * ray.direction) < 1e-5 ? kTop : kPlinth;
  return true;
}

double TurntableScene::free_distance(const Ray& axis, double slope) const {
  return march_cone(table_distance, kTableBall, axis, slope);
}

// A worn wooden top; a plinth in one colour, that shows no texture which could tell whether it turns.
Color TurntableScene::albedo(const Hit& hit, const Vector3d& x, float footprint) const {
  if (hit.surface == kPlinth) return {0.30f, 0.31f, 0.33f};
  const Vector3f p = x.cast<float>();
  const float grain = fractal_noise(seed_, 0.25f * p.x(), p.y(), p.z(), 0.008f, 4, footprint);
  const float stain = fractal_noise(seed_ + 1, p.x(), p.y(), p.z(), 0.05f, 4, footprint);
  const float scratch = fractal_noise(seed_ + 2, p.x(), p.y(), 0.3f * p.z(), 0.003f, 2, footprint);
  return Color(0.52f, 0.40f, 0.27f) * std::max(0.2f, 1.f + 0.22f * grain + 0.20f * stain + 0.15f * scratch);
}

Color TurntableScene::irradiance(const Hit& hit, const Vector3d& x, const Lighting& lighting) const {
  constexpr double kBreadth = 0.03;
  const double head =
      head_distance(x + kBreadth * hit.normal_in_map) / kBreadth;  // which darkens what is below it
  return skin_light(hit.normal_in_map.cast<float>(), head, lighting);
}

bool TurntableScene::is_object(const Hit& hit) const { return hit.surface == kTop; }

}  // namespace mono_pose_tracker
