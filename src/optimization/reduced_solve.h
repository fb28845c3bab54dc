#pragma once

#include <ceres/ceres.h>

#include "bundle_cameras.h"
#include "cancel_callback.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Solves for the cameras with the points eliminated (ReducedBundle), with the loss. The result is written to
// the cameras' blocks and the problem's points; all observations are used. False, with nothing changed, if
// the problem is unsuitable: too many free cameras, or residuals above noise.
bool solve_reduced(const BundleOptions& options, BundleCameras* cameras, BundleProblem* problem,
                   CancelCallback* cancel, ceres::Solver::Summary* summary);

}  // namespace mono_pose_tracker
