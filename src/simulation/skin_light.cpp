#include "simulation/skin_light.h"

#include <algorithm>
#include <cmath>

#include "simulation/noise.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3f;

/// Blinn's and Phong's highlight of a light, bright where the normal halves the angle between it and the
/// camera.
float highlight(const Vector3f& normal, const Vector3f& to_camera, const Vector3f& to_light,
                float sharpness) {
  return std::pow(std::max(0.f, normal.dot((to_light + to_camera).normalized())), sharpness);
}

}  // namespace

Color skin_light(const Vector3f& normal, double free, const Lighting& lighting) {
  // Light goes a little way through skin: the edge of the shadow lies beyond the horizon.
  const float key = std::max(0.f, (normal.dot(lighting.key_direction_in_map) + 0.3f) / 1.3f);
  const float fill = 0.5f + 0.5f * normal.dot(lighting.fill_direction_in_map);
  const float open = 0.35f + 0.65f * static_cast<float>(std::clamp(free, 0.0, 1.0));
  return Color(1.0f, 0.98f, 0.95f) * (0.92f * key * (0.4f + 0.6f * open)) +
         Color(0.95f, 0.98f, 1.0f) * (0.48f * fill * open);
}

Vector3f uneven_normal(std::uint32_t seed, const Eigen::Vector3d& x, const Eigen::Vector3d& normal) {
  const Vector3f p = x.cast<float>();
  const auto tilt = [&](std::uint32_t axis) {
    return fractal_noise(seed + axis, p.x(), p.y(), p.z(), 0.008f, 3, 1e-4f);
  };
  return (normal.cast<float>() + 0.10f * Vector3f(tilt(0), tilt(1), tilt(2))).normalized();
}

Color reflected_light(const Vector3f& normal, const Eigen::Vector3d& to_camera, const Lighting& lighting) {
  const Vector3f view = to_camera.cast<float>();
  return Color(1.0f, 0.97f, 0.92f) * highlight(normal, view, lighting.key_direction_in_map, 60) +
         Color(0.90f, 0.95f, 1.0f) * (0.5f * highlight(normal, view, lighting.fill_direction_in_map, 25));
}

}  // namespace mono_pose_tracker
