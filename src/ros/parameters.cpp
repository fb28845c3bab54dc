#include "ros/parameters.h"

#include <sstream>
#include <stdexcept>

#include "camera/camera_parameters.h"
#include "ros/camera_source.h"
#include "ros/parameter_reader.h"
#include "ros/paths.h"

namespace mono_pose_tracker {
namespace {

void read_node(ParameterReader& reader, NodeParameters& p) {
  reader.read("image_transport", &p.image_transport);
  reader.read("max_image_pixels", &p.max_image_pixels, 1, 1000000000);
  reader.read("camera_info_url", &p.camera_info_url);
  reader.read({"camera_info_source", &p.camera_info_source, 0, 0, kCameraInfoSources});
  if (p.camera_info_source == "file" && p.camera_info_url.empty()) {
    reader.add_problem("~camera_info_source is file: expected ~camera_info_url, the calibration file");
  }
  reader.read("hfov", &p.hfov, -1e9, 1e9);
  if (p.hfov != 0 && !(p.hfov >= kMinHfovDeg && p.hfov <= kMaxHfovDeg)) {
    std::ostringstream problem;
    problem << "~hfov is " << p.hfov << ", expected 0 (none) or 5 to 150 degrees";
    reader.add_problem(problem.str());
  }
  reader.read("grey_levels", &p.grey_levels);
  try {
    GreyLevelChoice{p.grey_levels};
  } catch (const std::invalid_argument& error) {
    reader.add_problem(std::string("~grey_levels ") + error.what());
  }
  reader.read({"rectified", &p.rectified, 0, 0, kRectifiedSettings});
  reader.read("queue_size", &p.queue_size, 1, 1000000);
  reader.read("time_jump", &p.time_jump, 0.0, 1e9);
  reader.read("mask_timeout", &p.mask_timeout, 0.0, 10.0);
  reader.read("input_timeout", &p.input_timeout, 0.1, 1e9);
  reader.read("publish_period", &p.publish_period, 0.01, 1e3);
  reader.read("path_max_length", &p.path_max_length, 1, 10000000);
  reader.read("trajectory_file", &p.trajectory_file);
  reader.read("save_trajectory_path", &p.save_trajectory_path);
  reader.read("map_path", &p.map_path);
  reader.read("load_map_at_start", &p.load_map_at_start);
  // The log begins its file anew: a map that was kept would be gone.
  const std::string problem = one_file_problem("map_path", p.map_path, "trajectory_file", p.trajectory_file);
  if (!problem.empty()) reader.add_problem(problem);
}

void read_frames(ParameterReader& reader, FrameOptions& f) {
  reader.read("map_frame", &f.map_frame);
  reader.read("camera_frame", &f.camera_frame);
  reader.read("base_frame", &f.base_frame);
  reader.read("odom_frame", &f.odom_frame);
  reader.read("view_frame", &f.view_frame);
  reader.read("object_mode", &f.object_mode);
  reader.read("object_frame", &f.object_frame);
  reader.read({"object_origin", &f.object_origin, 0, 0, {"first_camera", "centre"}});
  reader.read({"map_orientation", &f.map_orientation, 0, 0, {"optical", "z_up"}});
  reader.read("invert_tf", &f.invert_tf);
  reader.read("publish_tf", &f.publish_tf);
  reader.read("tf_timeout", &f.tf_timeout, 0.0, 10.0);
  reader.read("tf_rate", &f.tf_rate, 0.0, 1000.0);
  reader.read("tf_tolerance", &f.tf_tolerance, 0.0, 10.0);
  for (const std::string& problem : normalize_frames(&f)) reader.add_problem(problem);
}

}  // namespace

NodeParameters read_parameters(const ros::NodeHandle& private_handle) {
  NodeParameters parameters;
  ParameterReader reader(private_handle);
  read_node(reader, parameters);
  read_frames(reader, parameters.frames);
  for (const OptionEntry& option : option_table(&parameters.tracker)) reader.read(option);
  parameters.frames.scale_from_odometry = parameters.tracker.scale.odometry;
  if (parameters.frames.scale_from_odometry && parameters.frames.odom_frame.empty()) {
    reader.add_problem("~scale/odometry is true: expected ~odom_frame, the frame of the odometry");
  }
  reader.check("the tracker");
  parameters.tracker.validate();
  parameters.warnings = reader.unknown("the tracker");
  parameters.effective = reader.effective();
  return parameters;
}

}  // namespace mono_pose_tracker
