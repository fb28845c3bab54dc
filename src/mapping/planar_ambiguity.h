#pragma once

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// Resolves the planar two-fold ambiguity of a map. Two views of a wall or a poster fit two motions equally
/// well, and a nearly straight path separates them late. A map with the wrong one is consistent with itself,
/// as points that contradict it are not mapped. So alternative maps are built from the common matches of two
/// distant keyframes, with each alternative two-view geometry, and compared by cost. The alternatives of a
/// narrow map are its depth reversals (depth_reversal.h). ransac: threshold in radians.

/// Takes the best alternative when its cost is lower by min_evidence (share of the cost). Returns true when
/// the map was replaced: poses and landmarks have changed, and landmarks that the alternative cannot place
/// are gone.
bool correct_geometry(const BundleOptions& bundle, const RansacOptions& ransac, double min_evidence,
                      Map* map);

/// p-value (alternative_map.h) of the best alternative of the map's beginning; 0 where its keyframes have no
/// alternative geometry.
double planar_p_value(const BundleOptions& bundle, const RansacOptions& ransac, const Map& map);

}  // namespace mono_pose_tracker
