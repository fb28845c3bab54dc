#pragma once

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// The map as a long lens could mistake it for: seen from far away, an object looks the same with its depths
/// reversed and its turns the other way round (Necker's cube), and the same again when it is flatter and
/// turns farther. About the middle of the landmarks as the first keyframe sees it; turns are `stretch` times
/// as far, depths as much flatter. Images agree up to perspective.
void reverse_depth(double stretch, Map* map);

/// Whether the landmarks fill so little of the view that a map may have begun reversed: less than 8.6 degrees
/// (rms) round their middle.
bool is_narrow(const Map& map);

/// Adjusts the reversed map, of several stretches, beside the map itself, and takes it when its observations
/// fit better by min_evidence (share of the cost). True when it was taken: the poses have changed.
bool correct_depth_reversal(const BundleOptions& bundle, double min_evidence, Map* map);

}  // namespace mono_pose_tracker
