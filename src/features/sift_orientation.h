#pragma once

#include <array>

#include "sift_plane.h"

namespace mono_pose_tracker {

constexpr int kMaxOrientations =
    4;  // of one extremum; more peaks within 80 % of the highest mean no direction at all

/// Lowe (2004), section 5: the directions of the gradient around (x, y) in a Gaussian image of about `sigma`
/// px. Writes angles in rad in [0, 2 pi), x towards y; returns how many.
int find_orientations(const Plane& gaussian, float x, float y, float sigma,
                      std::array<float, kMaxOrientations>* angles);

}  // namespace mono_pose_tracker
