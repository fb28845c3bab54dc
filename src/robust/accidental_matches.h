#pragma once

#include <Eigen/Core>
#include <vector>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

/// One flag per pair: false for a possible accidental match, a wrong pair that happens to lie near its
/// epipolar line. Wrong matches lie anywhere along the line, correct ones where the scene is. Pairs are
/// classified by their distance along the line from the point to which the plane n . X = 1 (first view, units
/// of the baseline) maps them. A class is rejected if it holds no more pairs within the threshold (radians)
/// than accidental matches explain, as estimated from pairs farther off the line. Without this, accidental
/// matches bias the refined motion where the scene constrains it weakly (nearly planar scene, forward
/// motion).
std::vector<char> more_than_chance(const BearingPairs& pairs, const TwoViewModel& model,
                                   const Eigen::Vector3d& normal, double threshold);

}  // namespace mono_pose_tracker
