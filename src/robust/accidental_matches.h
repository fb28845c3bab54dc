#pragma once

#include <Eigen/Core>
#include <vector>

#include "robust/bearing_pairs.h"

namespace mono_pose_tracker {

struct AccidentalMatchOptions {
  // Accidental matches near a line are estimated from two bands on both sides of it, at this distance in
  // thresholds. The bands lie beyond the noise, are wide enough for a handful of pairs, and are a small part
  // of the image, over which wrong pairs have constant density.
  double nearest = 2, farthest = 22;
  // Largest probability that accidental matches alone fill a class. It is small because the motion was
  // selected among many for its number of inliers.
  double max_chance = 1e-3;
  // Smallest share of the pairs near their lines that must remain; with fewer the classification is
  // unreliable. With half of 500 pairs wrong, a handful of them lies near the lines.
  double min_share = 0.8;
};

/// One flag per pair: false for a possible accidental match, a wrong pair that happens to lie near its
/// epipolar line. Wrong matches lie anywhere along the line, correct ones where the scene is. Pairs are
/// classified by their distance along the line from the point to which the plane n . X = 1 (first view, units
/// of the baseline) maps them. A class is rejected if it holds no more pairs within the threshold (radians)
/// than accidental matches explain, as estimated from pairs farther off the line. Without this, accidental
/// matches bias the refined motion where the scene constrains it weakly (nearly planar scene, forward
/// motion).
std::vector<char> more_than_chance(const BearingPairs& pairs, const TwoViewModel& model,
                                   const Eigen::Vector3d& normal, double threshold,
                                   const AccidentalMatchOptions& options = {});

}  // namespace mono_pose_tracker
