#pragma once

#include <Eigen/Core>
#include <vector>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

/// One flag a pair: false where a pair may be near its epipolar line by nothing but chance. Wrong matches lie
/// anywhere along the line, right ones where the scene is: pairs are counted by how far along it they are
/// from where the plane n . X = 1 (first view, units of the baseline) maps them, and where no more of them
/// are within the threshold (radians) than chance brings there, judged by those farther off, none counts.
/// Refined by all pairs a motion goes after such pairs where the scene hardly tells it (nearly planar,
/// forward).
std::vector<char> more_than_chance(const BearingPairs& pairs, const TwoViewModel& model,
                                   const Eigen::Vector3d& normal, double threshold);

}  // namespace mono_pose_tracker
