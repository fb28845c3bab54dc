#pragma once

#include <optional>

#include "bundle_cameras.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// Solves for the cameras with the points eliminated (ReducedBundle), with the loss. The result is written to
// the cameras' blocks and the problem's points; all observations are used. Nothing, and nothing changed, if
// the problem is unsuitable: too many free cameras, or residuals above noise.
std::optional<BundleReport> solve_reduced(const BundleOptions& options, BundleCameras* cameras,
                                          BundleProblem* problem);

}  // namespace mono_pose_tracker
