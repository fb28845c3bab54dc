#pragma once

#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "io/image_decoding.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "ros/frame_options.h"

namespace mono_pose_tracker {

/// The private parameters of the nodelet that are no options of the tracker; the tracker's options are
/// private parameters as well.
struct NodeParameters {
  std::string image_transport = "raw";
  std::string camera_info_url;                               // calibration file; empty: none
  std::string camera_info_source = "auto";                   // auto, topic or file (CameraSource)
  int max_image_pixels = static_cast<int>(kMaxImagePixels);  // compressed images that promise more: refused
  std::string grey_levels = "auto";                          // of images of 16 bits (GreyLevelChoice)
  double hfov = 0;  // degrees from left to right, to guess a camera from without a calibration; 0: no guess
  std::string rectified = "auto";  // of the images: auto, true or false (decide_rectification)

  FrameOptions frames;

  int queue_size = 1;      // images that may wait; more than one trades latency for fewer drops
  double time_jump = 1.0;  // s: a larger step back of the stamps is a new start, a smaller one a stale image
  double mask_timeout = 0.1;    // s an image waits for its mask, while somebody publishes masks
  double input_timeout = 5.0;   // s without images or camera_info before a warning
  double publish_period = 0.5;  // s between two publications of map, keyframes and path
  int path_max_length = 20000;  // poses kept for ~path, ~camera_positions and ~save_trajectory
  std::string trajectory_file;  // written as it grows; empty: none
  std::string save_trajectory_path = "trajectory.txt";  // where ~save_trajectory writes
  std::string map_path = "tracker.map";                 // where ~save_map writes and ~load_map reads
  bool load_map_at_start = false;                       // what map_path names

  TrackerOptions tracker;

  std::vector<std::string> warnings;  // of parameters that nobody knows
  std::string effective;              // every parameter with the value in force, one line
};

/// Throws std::invalid_argument listing every value out of range or of another type, with key and range.
NodeParameters read_parameters(const ros::NodeHandle& private_handle);

}  // namespace mono_pose_tracker
