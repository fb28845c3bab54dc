#pragma once

#include <ceres/ceres.h>

#include "bundle_cameras.h"
#include "cancel_callback.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Solves for the cameras, whom the points follow (ReducedBundle), with the loss. The cameras' blocks and the
// problem's points are what it ends with; all its observations are heeded. False, with nothing done, where
// the problem does not suit: too many free cameras, or more than noise left.
bool solve_reduced(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem,
                   CancelCallback* cancel, ceres::Solver::Summary* summary);

}  // namespace mono_pose_tracker
