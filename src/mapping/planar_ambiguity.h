#pragma once

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// A map that was begun with the wrong one of two geometries agrees with itself: before a wall or a poster
/// two views fit its twin as well (the camera goes towards it where it went along it), and a path that is
/// nearly straight tells them apart late; what the twin does not explain is no part of the map by then. So it
/// is begun anew, beside, from what two of its keyframes far apart have in common, in each of the other
/// geometries these may have, and the two are compared by what they cost. A narrow map has no rivals here but
/// those of its depths (depth_reversal.h).
/// ransac: threshold in radians.

/// Takes the rival when its observations fit better by min_evidence (share of the cost). True when it was
/// taken: poses and landmarks have changed, landmarks that the rival can't place are gone.
bool correct_geometry(const BundleOptions& bundle, const RansacOptions& ransac, double min_evidence,
                      Map* map);

/// By what share of its cost the beginning of the map fits better than the best of its rivals; infinite where
/// its keyframes have no other geometry.
double geometry_evidence(const BundleOptions& bundle, const RansacOptions& ransac, const Map& map);

/// Less than this leaves it in doubt, for the reason given of depths (depth_reversal.h).
constexpr double kMinGeometryEvidence = 1.0 / 3;

}  // namespace mono_pose_tracker
