#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/alternative_map.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Replaces the map by its depth reversal. Seen from far away, an object looks the same with reversed depths
/// and opposite rotations (Necker reversal), and also when it is flatter and rotates farther (bas-relief
/// ambiguity). Depths are relative to the median of the landmarks in the first keyframe. Rotations are
/// multiplied by `stretch`, depths divided by it. The images agree up to perspective.
void reverse_depth(double stretch, Map* map);

/// The bas-relief transformation without the reversal: rotations are multiplied by `stretch`, depths divided
/// by it.
void stretch_depth(double stretch, Map* map);

/// Whether unit bearings lie within 8.6 degrees (rms) of their mean.
bool is_narrow(const std::vector<Eigen::Vector3d>& bearings);

/// Whether the landmarks fill so little of the view that the map may have begun depth-reversed: less than 8.6
/// degrees (rms) about their mean bearing.
bool is_narrow(const Map& map);

/// Adjusts depth-reversed maps of several stretches and takes the best of them when its cost is lower by
/// min_evidence (share of the cost). Returns true when the map was replaced: its poses have changed.
bool correct_depth_reversal(const BundleOptions& bundle, double min_evidence, Map* map);

/// p-value (alternative_map.h) of the best depth-reversed map, or of a stretched map that, when adjusted,
/// still rotates at least 1.5 times as far or at most two thirds as far: the larger. 0 where the map is not
/// narrow, as it is then unambiguous. A map of one rigid object that has rotated far enough has a small one.
/// A map with wrong depths fits no better than its reversal or than a flatter map with larger rotations. A
/// large map is compared by a sample of its landmarks.
double reversal_p_value(const BundleOptions& bundle, const Map& map);

}  // namespace mono_pose_tracker
