#include "simulation/torso_scene.h"

#include <algorithm>
#include <cmath>

#include "simulation/head_shape.h"
#include "simulation/noise.h"
#include "simulation/ray_march.h"
#include "simulation/skin_light.h"
#include "simulation/solid_parts.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

enum TorsoSurface { kShirt, kSkin };

const Ball kTorsoBall{{0, 0.40, 0.05}, 0.44};
const Vector3d kNeckBase(0, 0.200, 0.050), kNeckTopInHead(0, 0.045, 0.028);
const Ellipsoid kChest({0, 0.43, 0.060}, {0.185, 0.250, 0.115});

/// Without the neck; symmetric.
double trunk(const Vector3d& x) {
  const Vector3d p(std::sqrt(x.x() * x.x() + 9e-6), x.y(), x.z());
  double d = ellipsoid(p, kChest);
  d = blend(d, tapered_capsule(p, {0.03, 0.175, 0.060}, {0.135, 0.243, 0.060}, 0.036, 0.046), 0.06);
  d = blend(d, tapered_capsule(p, {0.10, 0.270, 0.055}, {0.172, 0.285, 0.055}, 0.060, 0.058), 0.04);
  return blend(d, tapered_capsule(p, {0.188, 0.30, 0.055}, {0.225, 0.60, 0.045}, 0.052, 0.045), 0.03);
}

/// Signed distance (m, about) beyond the edge of a round collar, negative where skin shows.
double beyond_collar(const Vector3d& x) {
  const double slope = 0.030 * smooth_step(0.06f, -0.04f, static_cast<float>(x.z()));  // lower in front
  return std::hypot(x.x(), 0.8 * (x.z() - 0.045)) + 1.6 * (x.y() - 0.195 - slope) - 0.064;
}

/// A striped knit: wide bands, a yarn of two greys, and creases.
Vector3f cloth(unsigned seed, const Vector3f& x, float footprint) {
  const float softness = 0.0012f + footprint;
  const float band = 0.026f, phase = x.y() / band - std::floor(x.y() / band);
  const float stripe =
      smooth_step(0, softness / band, phase) * smooth_step(0.32f, 0.32f - softness / band, phase);
  const Vector3f base(0.17f, 0.21f, 0.30f), light(0.60f, 0.57f, 0.50f);
  const float yarn = fractal_noise(seed, x.x(), x.y(), x.z(), 0.005f, 3, footprint);
  const float crease = fractal_noise(seed + 1, 0.4f * x.x(), 1.4f * x.y(), x.z(), 0.05f, 3, footprint);
  return (base + stripe * (light - base)) * (1.f + 0.28f * yarn + 0.20f * crease);
}

}  // namespace

TorsoScene::TorsoScene(std::uint32_t seed, const Rigid3& torso_from_head)
    : seed_(seed), torso_from_head_(torso_from_head), neck_top_(torso_from_head * kNeckTopInHead) {}

double TorsoScene::distance(const Vector3d& x) const {
  const double outside = (x - kTorsoBall.centre).norm() - kTorsoBall.radius;
  if (outside > 0.05) return outside;
  return blend(trunk(x), tapered_capsule(x, neck_top_, kNeckBase, 0.050, 0.057), 0.03);
}

bool TorsoScene::intersect(const Ray& ray, double start, Hit* hit) const {
  const auto field = [this](const Vector3d& x) { return distance(x); };
  if (!intersect_field(field, kTorsoBall, ray, start, hit)) return false;
  const Vector3d x = ray.origin + hit->distance * ray.direction;
  hit->surface = beyond_collar(x) > 0 ? kShirt : kSkin;
  return true;
}

double TorsoScene::free_distance(const Ray& axis, double slope) const {
  return march_cone([this](const Vector3d& x) { return distance(x); }, kTorsoBall, axis, slope);
}

// Where this place of the skin is in the head's frame when the head is at rest.
Vector3d TorsoScene::skin_place(const Vector3d& x) const {
  const Vector3d axis = neck_top_ - kNeckBase;
  const double s = std::clamp((x - kNeckBase).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  const Eigen::Quaterniond turned = Eigen::Quaterniond::Identity().slerp(s, torso_from_head_.rotation);
  const Vector3d on_axis = kNeckBase + s * axis, at_rest = kNeckBase + s * (kNeckTopInHead - kNeckBase);
  return at_rest + turned.conjugate() * (x - on_axis);
}

Color TorsoScene::albedo(const Hit& hit, const Vector3d& x, float footprint) const {
  if (hit.surface == kSkin) return head_albedo(seed_, {}, skin_place(x).cast<float>(), footprint);
  const float edge = smooth_step(0.010f, 0.008f, static_cast<float>(beyond_collar(x)));
  return cloth(seed_ + 40, x.cast<float>(), footprint) * (1.f - 0.45f * edge);  // the collar's edge
}

Color TorsoScene::irradiance(const Hit& hit, const Vector3d& x, const Lighting& lighting) const {
  // The chin darkens the neck, the head the shoulders.
  constexpr double kBreadth = 0.03;
  const Vector3d off = x + kBreadth * hit.normal_in_map;
  const double head = head_distance(torso_from_head_.inverse() * off, false);
  return skin_light(hit.normal_in_map.cast<float>(), std::min(distance(off), head) / kBreadth, lighting);
}

}  // namespace mono_pose_tracker
