#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// The map as a long lens could mistake it for: seen from far away, an object looks the same with its depths
/// reversed and its turns the other way round (Necker's cube), and the same again when it is flatter and
/// turns farther. About the middle of the landmarks as the first keyframe sees it; turns are `stretch` times
/// as far, depths as much flatter. Images agree up to perspective.
void reverse_depth(double stretch, Map* map);

/// The same without the reversal, as a relief looks like the statue: turns `stretch` times as far, depths as
/// much flatter.
void stretch_depth(double stretch, Map* map);

/// Whether unit bearings lie within 8.6 degrees (rms) of their middle.
bool is_narrow(const std::vector<Eigen::Vector3d>& bearings);

/// Whether the landmarks fill so little of the view that a map may have begun reversed: less than 8.6 degrees
/// (rms) round their middle.
bool is_narrow(const Map& map);

/// Adjusts the reversed map, of several stretches, beside the map itself, and takes it when its observations
/// fit better by min_evidence (share of the cost). True when it was taken: the poses have changed.
bool correct_depth_reversal(const BundleOptions& bundle, double min_evidence, Map* map);

/// By what share of its cost the map fits better than the best of its reversed ones, and than any that turns
/// half as far again or less and stays so when it is adjusted; infinite where it is not narrow and can't be
/// mistaken. What has turned far enough, and is one rigid body, is beyond doubt; a map that is wrong in depth
/// is fitted no better than its reverse, or than one that is flatter and turns farther. A large map is
/// compared by a sample of its landmarks.
double depth_evidence(const BundleOptions& bundle, const Map& map);

/// Less than this leaves the depth in doubt: for a map that is right, a reverse that costs only a third more
/// would take every fourth unit of its cost to be something other than noise.
constexpr double kMinDepthEvidence = 1.0 / 3;

}  // namespace mono_pose_tracker
