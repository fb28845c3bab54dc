#include "ros/parameters.h"

#include <ros/package.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>

#include "camera/camera_parameters.h"
#include "ros/camera_info.h"

namespace mono_pose_tracker {
namespace {

bool starts_with(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

std::string expand_prefix(const std::string& path) {
  if (starts_with(path, "file://")) return path.substr(7);
  if (starts_with(path, "package://")) {
    const std::size_t slash = path.find('/', 10);
    const std::string package = path.substr(10, slash == std::string::npos ? slash : slash - 10);
    const std::string folder = ros::package::getPath(package);
    if (folder.empty()) throw std::runtime_error(path + ": package \"" + package + "\" is not found");
    return slash == std::string::npos ? folder : folder + path.substr(slash);
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here changes the environment
  const char* home = std::getenv("HOME");
  if (home != nullptr && (path == "~" || starts_with(path, "~/"))) return home + path.substr(1);
  return path;
}

}  // namespace

std::string expand_path(const std::string& path) {
  if (path.empty()) return path;
  return std::filesystem::absolute(expand_prefix(path)).lexically_normal().string();
}

std::string one_file_problem(const std::string& parameter, const std::string& path,
                             const std::string& other_parameter, const std::string& other_path) {
  if (path.empty() || other_path.empty()) return "";
  const std::string a = expand_path(path), b = expand_path(other_path);
  std::error_code none_there;
  if (a != b && !std::filesystem::equivalent(a, b, none_there)) return "";
  return "~" + parameter + " and ~" + other_parameter + " are the same file, " + b + ": they must differ";
}

std::string without_leading_slashes(const std::string& frame) {
  const std::size_t begin = frame.find_first_not_of('/');
  return begin == std::string::npos ? "" : frame.substr(begin);
}

std::vector<std::string> normalize_frames(FrameOptions* options) {
  FrameOptions& o = *options;
  std::vector<std::string> problems;
  std::map<std::string, std::string> used;  // the parameter that took a name
  const auto take = [&](const char* parameter, std::string* frame, bool counts) {
    *frame = without_leading_slashes(*frame);
    if (!counts || frame->empty()) return;
    const auto [other, first] = used.emplace(*frame, parameter);
    if (!first) {
      problems.push_back(std::string("~") + parameter + " and ~" + other->second + " are both \"" + *frame +
                         "\": they must differ");
    }
  };
  take("map_frame", &o.map_frame, !o.object_mode);
  take("object_frame", &o.object_frame, o.object_mode);
  take("camera_frame", &o.camera_frame, true);
  take("base_frame", &o.base_frame, true);
  take("odom_frame", &o.odom_frame, true);
  take("view_frame", &o.view_frame, true);
  std::string middle = o.view_frame.empty() ? "" : o.view_frame + kMiddleSuffix;
  take("view_frame with the suffix _object", &middle, o.object_mode);
  if (o.map_frame.empty()) problems.push_back("~map_frame is empty");
  if (o.object_frame.empty()) problems.push_back("~object_frame is empty");
  if (!o.odom_frame.empty() && o.object_mode) {
    problems.push_back("~odom_frame and ~object_mode: an object has no odometry, set only one of them");
  } else if (!o.odom_frame.empty() && o.invert_tf) {
    problems.push_back(
        "~odom_frame and ~invert_tf: map would be a child of odom and could not be the root of tf; set only "
        "one of them");
  }
  if (o.object_origin == "centre" && !o.object_mode) {
    problems.push_back("~object_origin is centre: this needs ~object_mode");
  }
  return problems;
}

namespace {

std::string to_text(XmlRpc::XmlRpcValue& value) {
  char text[64];
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value) ? "true" : "false";
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::to_string(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      std::snprintf(text, sizeof(text), "%.17g", static_cast<double>(value));
      return text;
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    default:
      return value.toXml();
  }
}

/// Parameters below the node's name that other libraries read. image_transport's plugins have theirs below
/// the topics that are published, and below their own names of what is subscribed to.
bool is_of_a_library(const std::string& key) {
  if (key == "diagnostic_period" || key == "num_worker_threads") return true;
  const auto is_below = [&key](const char* folder) { return key.rfind(folder, 0) == 0; };
  constexpr std::array folders{"debug_image/", "image_raw/",       "mask/",
                               "compressed/",  "compressedDepth/", "theora/"};
  return std::any_of(folders.begin(), folders.end(), is_below);
}

std::string joined(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : separator) + part;
  return text;
}

}  // namespace

void ParameterReader::read(const OptionEntry& option) {
  XmlRpc::XmlRpcValue value;
  if (handle_.getParam(option.key, value)) {
    const std::string text = to_text(value);
    if (!set_option(option, text) || !is_in_range(option)) {
      problems_.push_back("~" + option.key + " is " + text + ", expected " + expected_value(option));
    }
  }
  values_.emplace_back(option.key, option_text(option));
}

void ParameterReader::check(const std::string& owner) const {
  if (problems_.empty()) return;
  std::vector<std::string> all = problems_;
  for (std::string& line : unknown(owner)) all.push_back(std::move(line));
  throw std::invalid_argument(joined(all, "; "));
}

bool ParameterReader::is_known(const std::string& key) const {
  return is_of_a_library(key) ||
         std::any_of(values_.begin(), values_.end(), [&](const auto& v) { return v.first == key; });
}

std::vector<std::string> ParameterReader::unknown(const std::string& owner) const {
  std::vector<OptionEntry> table;
  for (const auto& value : values_) table.push_back({value.first, {}, 0, 0, {}});
  std::vector<std::string> all, lines;
  handle_.getParamNames(all);
  const std::string prefix = handle_.getNamespace() + "/";
  for (const std::string& name : all) {
    if (name.rfind(prefix, 0) != 0) continue;
    const std::string key = name.substr(prefix.size());
    if (is_known(key)) continue;
    const std::string meant = suggestion_for(table, key);
    lines.push_back("~" + key + " is not a parameter of " + owner +
                    (meant.empty() ? "" : "; did you mean ~" + meant + "?"));
  }
  return lines;
}

std::string ParameterReader::effective() const {
  std::vector<std::string> parts;
  for (const auto& [key, text] : values_) parts.push_back(key + ": " + (text.empty() ? "''" : text));
  return joined(parts, ", ");
}

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
