#pragma once

#include <cstdint>
#include <vector>

#include "geometry/motion_prior.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

std::vector<TimedCenter> centers_of(const std::vector<RegisteredFrame>& frames);

// A frame's camera center and how uncertain the image leaves it; held: it stays where it is.
struct UncertainCenter : TimedCenter {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  bool is_held = true;
};

// Moves those that are not held to where images and motion together say that they were: least squares of both
// over all of them, with Huber's loss of the motion. In time's order; stamps that do not grow tie nothing.
void smooth_centers(const MotionPrior& prior, std::vector<UncertainCenter>* in_time);

}  // namespace mono_pose_tracker
