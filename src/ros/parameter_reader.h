#pragma once

#include <ros/node_handle.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
