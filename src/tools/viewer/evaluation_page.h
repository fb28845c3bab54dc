#pragma once

#include <vector>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "scene_page.h"

namespace mono_pose_tracker {

/// An estimated trajectory and its error against the reference.
struct EvaluatedPath {
  std::vector<StampedPose> poses;
  TrajectoryError error;
};

/// The page of the reference and of the estimates, aligned to it and coloured by their errors of position.
ScenePage evaluation_page(const std::vector<StampedPose>& reference, const std::vector<EvaluatedPath>& paths);

}  // namespace mono_pose_tracker
