#pragma once

#include <cstdint>

#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Light arriving on skin and cloth; `free`: unoccluded share, 0 to 1 and more, a finger's breadth above the
/// surface.
Color skin_light(const Eigen::Vector3f& normal, double free, const Lighting& lighting);

/// A normal disturbed by some degrees, in patches of 2 to 8 mm, as by pores or hammered metal.
Eigen::Vector3f uneven_normal(std::uint32_t seed, const Eigen::Vector3d& x, const Eigen::Vector3d& normal);

/// Reflection of the lamp and the window in a surface of strength 1. It stays nearly constant in space while
/// the object turns.
Color reflected_light(const Eigen::Vector3f& normal, const Eigen::Vector3d& to_camera,
                      const Lighting& lighting);

}  // namespace mono_pose_tracker
