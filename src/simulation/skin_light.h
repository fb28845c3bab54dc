#pragma once

#include <cstdint>

#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Light that arrives on skin and cloth; `free`: the share, 0 to 1 and more, of a finger's breadth off the
/// surface that is free.
Color skin_light(const Eigen::Vector3f& normal, double free, const Lighting& lighting);

/// A normal that a hammered surface or pores turn off the smooth one by some degrees, in patches of 2 to 8
/// mm.
Eigen::Vector3f uneven_normal(std::uint32_t seed, const Eigen::Vector3d& x, const Eigen::Vector3d& normal);

/// The reflection of the lamp and the window in a surface of strength 1. It stays about where it is in space
/// while the body turns.
Color reflected_light(const Eigen::Vector3f& normal, const Eigen::Vector3d& to_camera,
                      const Lighting& lighting);

}  // namespace mono_pose_tracker
