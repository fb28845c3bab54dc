#include "mono_pose_tracker/ros/parameters.h"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {
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

/// Reads private parameters over their defaults and collects what is wrong with them, so that all is told at
/// once.
class Reader {
 public:
  explicit Reader(const ros::NodeHandle& handle) : handle_(handle) {}

  template <typename T>
  void read(const std::string& key, const char* type, T* value) {
    known_.push_back(key);
    if (handle_.hasParam(key) && !handle_.getParam(key, *value)) {
      problems_.push_back("~" + key + " is not " + type);
    }
  }

  void read(const std::string& key, std::string* value) { read(key, "a string", value); }
  void read(const std::string& key, bool* value) { read(key, "true or false", value); }

  template <typename T>
  void read(const std::string& key, T* value, T least, T most) {
    read(key, "a number", value);
    if (*value >= least && *value <= most) return;
    std::ostringstream problem;
    problem << "~" << key << " is " << *value << ", not in [" << least << ", " << most << "]";
    problems_.push_back(problem.str());
  }

  void read(const OptionEntry& option) {
    known_.push_back(option.key);
    XmlRpc::XmlRpcValue value;
    if (!handle_.getParam(option.key, value)) return;
    const std::string text = to_text(value);
    if (!set_option(option, text) || !is_in_range(option)) {
      problems_.push_back("~" + option.key + " is " + text + ", expected " + expected_value(option));
    }
  }

  const std::vector<std::string>& problems() const { return problems_; }
  const std::vector<std::string>& known() const { return known_; }

 private:
  const ros::NodeHandle& handle_;
  std::vector<std::string> problems_;
  std::vector<std::string> known_;
};

void read_node(Reader& reader, NodeParameters& p) {
  reader.read("image_transport", &p.image_transport);
  reader.read("camera_info_url", &p.camera_info_url);
  reader.read("rectified", &p.rectified);
  reader.read("map_frame", &p.map_frame);
  reader.read("camera_frame", &p.camera_frame);
  reader.read("publish_tf", &p.publish_tf);
  reader.read("queue_size", &p.queue_size, 1, 1000000);
  reader.read("time_jump", &p.time_jump, 0.0, 1e9);
  reader.read("mask_timeout", &p.mask_timeout, 0.0, 10.0);
  reader.read("input_timeout", &p.input_timeout, 0.1, 1e9);
  reader.read("publish_period", &p.publish_period, 0.01, 1e3);
  reader.read("path_max_length", &p.path_max_length, 1, 10000000);
  reader.read("trajectory_file", &p.trajectory_file);
  reader.read("save_trajectory_path", &p.save_trajectory_path);
}

/// Parameters below the node's name that other libraries read.
bool is_of_a_library(const std::string& key) {
  return key == "diagnostic_period" || key == "num_worker_threads" || key.rfind("debug_image/", 0) == 0;
}

std::vector<std::string> warn_of_unknown(const ros::NodeHandle& handle,
                                         const std::vector<std::string>& known) {
  std::vector<OptionEntry> table;
  for (const std::string& key : known) table.push_back({key, {}, 0, 0, {}});
  std::vector<std::string> all, warnings;
  handle.getParamNames(all);
  const std::string prefix = handle.getNamespace() + "/";
  for (const std::string& name : all) {
    if (name.rfind(prefix, 0) != 0) continue;
    const std::string key = name.substr(prefix.size());
    if (is_of_a_library(key) || std::find(known.begin(), known.end(), key) != known.end()) continue;
    warnings.push_back("~" + key + " is no parameter of the tracker; did you mean ~" +
                       nearest_key(table, key) + "?");
  }
  return warnings;
}

}  // namespace

NodeParameters read_parameters(const ros::NodeHandle& private_handle) {
  NodeParameters parameters;
  Reader reader(private_handle);
  read_node(reader, parameters);
  for (const OptionEntry& option : option_table(&parameters.tracker)) reader.read(option);
  std::string problems;
  for (const std::string& problem : reader.problems()) problems += (problems.empty() ? "" : "; ") + problem;
  if (!problems.empty()) throw std::invalid_argument(problems);
  parameters.tracker.validate();
  parameters.warnings = warn_of_unknown(private_handle, reader.known());
  return parameters;
}

}  // namespace mono_pose_tracker
