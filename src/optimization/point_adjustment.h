#pragma once

#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Optimises the points with all cameras fixed, whatever their flags. Each point is solved by itself (damped
/// Newton, at most max_iterations steps), so that a bad one delays no other. Residuals and loss are those of
/// adjust_bundle. A point with fewer than two observations in front of their cameras stays, as does one
/// without improvement. usable: at least one point had two observations; iterations: the largest number of
/// steps of a point. max_seconds and num_threads are ignored: a point takes microseconds.
BundleReport adjust_points(const BundleOptions& options, BundleProblem* problem);

}  // namespace mono_pose_tracker
