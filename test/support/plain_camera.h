#pragma once

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// A camera without distortion in round numbers, for projections by hand.
inline CameraModel plain_camera() {
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = p.fy = 500;
  p.cx = 320;
  p.cy = 240;
  return CameraModel(p);
}

}  // namespace mono_pose_tracker
