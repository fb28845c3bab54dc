#pragma once

#include "bundle_cameras.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Solves for cameras and points together, with Ceres' Schur complement. The result is written to the cameras'
// blocks and the problem's points. All observations are used; there must be at least one.
BundleReport solve_in_full(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem);

}  // namespace mono_pose_tracker
