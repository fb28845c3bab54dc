#pragma once

#include <ros/node_handle.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "io/image_coding.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// The full path: a leading ~ becomes the home folder, package://PACKAGE/ the package's folder, file:// is
/// taken off, and a relative path begins in the working folder (of a node that roslaunch started: ~/.ros).
/// Throws std::runtime_error when there is no such package.
std::string expand_path(const std::string& path);

/// An error text if these two path parameters, as given by the user, refer to one file; empty otherwise.
std::string one_file_problem(const std::string& parameter, const std::string& path,
                             const std::string& other_parameter, const std::string& other_path);

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

/// Reads the private parameters of a node over their defaults, and collects all errors to report them
/// together.
class ParameterReader {
 public:
  explicit ParameterReader(const ros::NodeHandle& private_handle) : handle_(private_handle) {}

  void read(const std::string& key, std::string* value) { read_value(key, "a string", value); }
  void read(const std::string& key, bool* value) { read_value(key, "true or false", value); }

  /// A number between least and most.
  template <typename T>
  void read(const std::string& key, T* value, T least, T most) {
    if (!read_value(key, "a number", value) || (*value >= least && *value <= most)) return;
    std::ostringstream problem;
    problem << "~" << key << " is " << *value << ", not in [" << least << ", " << most << "]";
    problems_.push_back(problem.str());
  }

  void read(const OptionEntry& option);

  void add_problem(const std::string& problem) { problems_.push_back(problem); }

  /// Throws std::invalid_argument that names every value out of range or of another type, and every unknown
  /// parameter. To be called after reading all parameters.
  void check(const std::string& owner) const;

  /// A line for each unknown private parameter, with the nearest known one. owner: "the tracker".
  std::vector<std::string> unknown(const std::string& owner) const;

  /// The values in force, "key: value, key: value, ...", in the order they were read.
  std::string effective() const;

 private:
  /// False when there is a value of another type.
  template <typename T>
  bool read_value(const std::string& key, const char* type, T* value) {
    const bool ok = !handle_.hasParam(key) || handle_.getParam(key, *value);
    if (!ok) problems_.push_back("~" + key + " is not " + type);
    std::ostringstream text;
    text << std::boolalpha << *value;
    values_.emplace_back(key, text.str());
    return ok;
  }
  bool is_known(const std::string& key) const;

  ros::NodeHandle handle_;
  std::vector<std::string> problems_;
  std::vector<std::pair<std::string, std::string>> values_;  // key and text of all that was read
};

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
