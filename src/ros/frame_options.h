#pragma once

#include <string>
#include <vector>

namespace mono_pose_tracker {

/// Behind ~view_frame: the middle of the object.
constexpr const char* kMiddleSuffix = "_object";

/// Which frames the results are given in (private parameters of the nodelet, see doc/parameters.md).
struct FrameOptions {
  std::string map_frame = "map";
  std::string camera_frame;  // empty: the image's frame_id
  std::string base_frame;    // of the robot that carries the camera; empty: the camera stands for itself
  std::string odom_frame;    // map -> odom is published, to correct it; empty: map -> camera or base
  bool object_mode = false;  // the map is an object that turns before the camera
  std::string object_frame = "object";         // what it is called then
  std::string object_origin = "first_camera";  // or centre: of the object's points
  std::string map_orientation = "optical";  // axes of the first camera: x right; or z_up: x forward, y left
  std::string view_frame = "tracker_view";  // where the camera is, for rviz to follow; empty: none
  bool invert_tf = false;                   // tf with parent and child changed over
  bool publish_tf = true;
  bool scale_from_odometry = false;  // scale/odometry: the map is in metres once the robot has driven
  double tf_timeout = 0.05;          // s of the wall that an image waits for tf of its time, at most
  double tf_rate = 20;               // Hz at which map -> odom is sent again; 0: with each pose only
  double tf_tolerance = 0.1;         // s that it is stamped ahead then
};

/// tf2 does not know the leading slashes of older frames.
std::string without_leading_slashes(const std::string& frame);

/// Takes off leading slashes. Returns one line for each combination that can't be:
/// a frame with two parents, or one that is its own parent.
std::vector<std::string> normalize_frames(FrameOptions* options);

}  // namespace mono_pose_tracker
