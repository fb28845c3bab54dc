#include <algorithm>
#include <cmath>

#include "mono_pose_tracker/simulation/head_shape.h"
#include "mono_pose_tracker/simulation/noise.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3f;

/// One size of spots: balls strewn in space, one to a cell at most, seen where the surface cuts them.
struct Spots {
  float cell;             // m
  float smallest_radius;  // m; the largest is smallest + spread
  float spread;           // m
  float density;          // share of the cells that hold a spot
  float darkest;          // change of brightness at most
};

/// Uniform in [0, 1) from ten bits.
float unit_bits(unsigned bits) { return static_cast<float>(bits & 1023u) * 0x1.0p-10f; }

/// Sum of the darkening by all spots at a point.
float spot_darkness(const Spots& spots, unsigned seed, const Vector3f& x, float footprint) {
  const Vector3f q = x / spots.cell;
  const int x0 = floor_int(q.x() - 0.5f), y0 = floor_int(q.y() - 0.5f), z0 = floor_int(q.z() - 0.5f);
  const float reach = (1.25f * (spots.smallest_radius + spots.spread) + 0.5f * footprint) / spots.cell;
  const float reach_squared = reach * reach;
  float darkness = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = x0 + (corner & 1), j = y0 + (corner >> 1 & 1), k = z0 + (corner >> 2);
    const unsigned h = hash_cell(seed, i, j, k);
    // No nearer than a twentieth of a cell to its sides: spots of up to half a cell stay within the nearest
    // 2^3 cells.
    const Vector3f centre(i + 0.05f + 0.9f * unit_bits(h), j + 0.05f + 0.9f * unit_bits(h >> 10),
                          k + 0.05f + 0.9f * unit_bits(h >> 20));
    const float distance_squared = (q - centre).squaredNorm();
    if (distance_squared > reach_squared) continue;
    const unsigned h1 = rehash(h), h2 = rehash(h1);
    if (unit_float(h1) > spots.density) continue;
    const float radius = spots.smallest_radius + spots.spread * unit_float(h2);
    const float softness = 0.25f * radius + 0.5f * footprint;
    const float distance = spots.cell * std::sqrt(distance_squared);
    const float strength = spots.darkest * (0.4f + 0.6f * unit_float(h2 * 0x9e3779b1u));
    darkness += strength * smooth_step(radius + softness, radius - softness, distance);
  }
  return darkness;
}

float inside(float signed_distance, float softness) {
  return smooth_step(softness, -softness, signed_distance);
}

void paint(float weight, const Vector3f& over, Vector3f* color) { *color += weight * (over - *color); }

/// Skin: redder on cheeks, nose and ears, uneven at all scales, with moles, freckles and pores.
Vector3f skin(unsigned seed, const Vector3f& x, float footprint) {
  Vector3f color(0.80f, 0.63f, 0.53f);
  const float cheek =
      std::exp(-(Vector3f(std::fabs(x.x()) - 0.045f, x.y() - 0.04f, x.z() + 0.07f)).squaredNorm() / 8e-4f);
  const float nose = std::exp(-(x - Vector3f(0, 0.036f, -0.118f)).squaredNorm() / 3e-4f);
  const float ear = smooth_step(0.074f, 0.086f, std::fabs(x.x()));
  paint(0.35f * std::min(1.f, cheek + nose + ear), Vector3f(0.78f, 0.46f, 0.40f), &color);
  color *= 1.f + 0.06f * fractal_noise(seed, x.x(), x.y(), x.z(), 0.03f, 3, footprint);
  color *= 1.f + 0.05f * fractal_noise(seed + 1, x.x(), x.y(), x.z(), 0.006f, 3, footprint);
  const Spots moles{0.024f, 0.0012f, 0.0012f, 0.4f, 0.40f};
  const Spots freckles{0.008f, 0.0009f, 0.0009f, 0.8f, 0.32f};
  const Spots small_freckles{0.0041f, 0.0006f, 0.0007f, 0.9f, 0.32f};
  const float darkness = spot_darkness(moles, seed + 2, x, footprint) +
                         spot_darkness(freckles, seed + 3, x, footprint) +
                         spot_darkness(small_freckles, seed + 4, x, footprint);
  // Melanin takes more of the blue than of the red.
  return color.cwiseProduct(
      Vector3f(1.f - 0.8f * darkness, 1.f - darkness, 1.f - 1.1f * darkness).cwiseMax(0.15f));
}

/// Strands that run down from the crown: thin around the head, long along it.
Vector3f hair(unsigned seed, const Vector3f& x, float footprint) {
  constexpr float kRadius = 0.08f;  // m, of the skull: makes lengths of azimuths
  const float z = x.z() - 0.02f;
  const float around = kRadius * std::atan2(x.x(), -z);
  const float off_axis = std::max(std::hypot(x.x(), z), 0.01f);
  const float along = 0.25f * x.y() + 0.2f * off_axis;
  const float squeezed = std::max(footprint, footprint * kRadius / off_axis);  // azimuths crowd at the crown
  const float lock = fractal_noise(seed + 10, around, along, 0.012f, 2, squeezed);
  const float strand = fractal_noise(seed + 11, around, along, 0.003f, 2, squeezed);
  return Vector3f(0.30f, 0.22f, 0.16f) * (1.f + 0.30f * lock + 0.80f * strand);
}

/// 1 on the scalp, 0 on the face, the neck and the ears.
float hair_weight(unsigned seed, const Vector3f& x) {
  const float hairline = -0.068f + 0.125f * smooth_step(-0.085f, 0.07f, x.z());
  const float ragged = 0.004f * value_noise(seed + 12, 300 * x.x(), 300 * x.y(), 300 * x.z());
  const float scalp = inside(x.y() - hairline + ragged, 0.004f);
  const float ear =
      inside((Eigen::Vector2f((x.y() - 0.012f) / 0.036f, (x.z() - 0.018f) / 0.027f)).norm() - 1.f, 0.08f) *
      smooth_step(0.070f, 0.075f, std::fabs(x.x()));
  return scalp * (1.f - ear);
}

void paint_eyes(const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.07f || std::fabs(x.y() - 0.003f) > 0.02f) return;
  const float u = (std::fabs(x.x()) - 0.032f) / 0.0125f, v = x.y() - 0.0035f;
  if (std::fabs(u) > 1.3f) return;
  const float softness = 0.0003f + 0.5f * footprint;
  const float lid = std::fabs(v) - 0.0052f * (1.f - u * u);  // signed distance, about, from the almond's edge
  paint(0.7f * inside(std::fabs(lid) - 0.0007f, softness), Vector3f(0.22f, 0.15f, 0.12f), color);
  const float open = inside(lid + 0.0004f, softness);
  const float r = std::hypot(0.0125f * u, v + 0.0005f);
  Vector3f eye(0.82f, 0.80f, 0.77f);
  paint(inside(r - 0.0056f, softness), Vector3f(0.30f, 0.26f, 0.18f), &eye);
  paint(inside(r - 0.0024f, softness), Vector3f(0.05f, 0.05f, 0.05f), &eye);
  paint(open, eye, color);
}

void paint_brows(unsigned seed, const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.06f) return;
  const float u = (std::fabs(x.x()) - 0.034f) / 0.021f;
  const float arch = -0.0235f - 0.004f * (1.f - u * u) + 0.002f * u;
  const float ragged = 0.0012f * value_noise(seed + 13, 900 * x.x(), 300 * x.y(), 300 * x.z());
  const float edge = std::max(std::fabs(x.y() - arch) - 0.0042f * std::sqrt(std::max(0.f, 1.f - u * u)),
                              0.021f * (std::fabs(u) - 1.f));
  paint(0.8f * inside(edge + ragged, 0.0012f + 0.5f * footprint), 0.85f * hair(seed + 20, x, footprint),
        color);
}

void paint_lips(const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.06f) return;
  const float u = x.x() / 0.025f;
  const float half = 0.0100f * std::max(0.f, 1.f - u * u);
  const float softness = 0.0012f + 0.5f * footprint;
  paint(0.6f * inside(std::fabs(x.y() - 0.0715f) - half, softness), Vector3f(0.72f, 0.42f, 0.39f), color);
  paint(
      0.6f * inside(std::fabs(x.y() - 0.0718f) - 0.0008f, 0.0005f + 0.5f * footprint) * (std::fabs(u) < 1.f),
      Vector3f(0.30f, 0.14f, 0.14f), color);
}

}  // namespace

Vector3f head_albedo(unsigned seed, const Vector3f& x, float footprint) {
  const float scalp = hair_weight(seed, x);
  Vector3f color = hair(seed, x, footprint);
  if (scalp < 1.f) {
    Vector3f face = skin(seed, x, footprint);
    paint_lips(x, footprint, &face);
    paint_brows(seed, x, footprint, &face);
    paint_eyes(x, footprint, &face);
    color = face + scalp * (color - face);
  }
  return color;
}

}  // namespace mono_pose_tracker
