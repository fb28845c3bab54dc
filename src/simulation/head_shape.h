#pragma once

#include <Eigen/Core>

#include <Eigen/Geometry>
#include "simulation/head_look.h"

namespace mono_pose_tracker {

/// A life-sized head in its own frame: origin between the ears at the level of the eyes, metres, x to the
/// image's right, y down, z backwards (the face looks along -z), so that a camera straight before it has
/// parallel axes. Returns a lower bound of the distance to its surface, negative inside, zero exactly on it
/// (Hart 1996; Quilez). Without its neck the head ends below jaw and skull.
double head_distance(const Eigen::Vector3d& x_in_head, bool with_neck = true);

/// Everything of the head lies in the ball of this radius (m) about this point.
inline Eigen::Vector3d head_bound_centre() { return {0, 0.09, 0.02}; }
constexpr double kHeadBoundRadius = 0.28;

/// Colours of the skin, hair, eyes, lips: see head_skin.cpp.
Eigen::Vector3f head_albedo(unsigned seed, const HeadLook& look, const Eigen::Vector3f& x_in_head,
                            float footprint);

}  // namespace mono_pose_tracker
