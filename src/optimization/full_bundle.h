#pragma once

#include <ceres/ceres.h>

#include "bundle_cameras.h"
#include "cancel_callback.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Solves for cameras and points at once, with Ceres' Schur complement. The cameras' blocks and the problem's
// points are what it ends with; all its observations are heeded, of which there must be some.
ceres::Solver::Summary solve_in_full(const BundleOptions& options, BundleCameras* cameras,
                                     BundleProblem* problem, CancelCallback* cancel);

}  // namespace mono_pose_tracker
