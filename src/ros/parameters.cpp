#include "mono_pose_tracker/ros/parameters.h"

#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace mono_pose_tracker {
namespace {

/// Reads private parameters over their defaults and collects what is wrong with them, so that all is told at
/// once.
class Reader {
 public:
  explicit Reader(const ros::NodeHandle& handle) : handle_(handle) {}

  template <typename T>
  void read(const std::string& key, const char* type, T* value) {
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

  const std::vector<std::string>& problems() const { return problems_; }

 private:
  const ros::NodeHandle& handle_;
  std::vector<std::string> problems_;
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

void read_tracker(Reader& reader, TrackerOptions& options) {
  int seed = static_cast<int>(options.seed);
  reader.read("seed", &seed, 0, std::numeric_limits<int>::max());
  options.seed = static_cast<std::uint64_t>(seed);
}

}  // namespace

NodeParameters read_parameters(const ros::NodeHandle& private_handle) {
  NodeParameters parameters;
  Reader reader(private_handle);
  read_node(reader, parameters);
  read_tracker(reader, parameters.tracker);
  std::string problems;
  for (const std::string& problem : reader.problems()) problems += (problems.empty() ? "" : "; ") + problem;
  if (!problems.empty()) throw std::invalid_argument(problems);
  parameters.tracker.validate();
  return parameters;
}

}  // namespace mono_pose_tracker
