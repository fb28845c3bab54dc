#pragma once

#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// The best points under cameras that stay where they are, whatever their flags say: each by itself (Newton's
/// method, damped, at most max_iterations steps), so that a bad one holds up no other. The residuals and the
/// loss are those of adjust_bundle. A point with fewer than two observations before their cameras stays, and
/// so does one that finds nothing better. usable: at least one point had two; iterations: the most steps that
/// a point took. max_seconds and num_threads have no say: this takes microseconds a point.
BundleReport adjust_points(const BundleOptions& options, BundleProblem* problem);

}  // namespace mono_pose_tracker
