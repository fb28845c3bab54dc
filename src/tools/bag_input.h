#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ros/bag_image_source.h"
#include "ros/rosbag2_image_source.h"

namespace mono_pose_tracker {

// Bags of ROS 1, or one recording of ROS 2, by what the paths are. All throw as the sources' constructors.

/// Throws std::runtime_error, one line, when a recording of ROS 2 is not alone, or a folder holds none.
inline void check_bags(const std::vector<std::string>& paths) {
  std::error_code ignored;
  for (const std::string& path : paths) {
    if (std::filesystem::is_directory(path, ignored) && !is_rosbag2(path)) {
      throw std::runtime_error(path +
                               ": holds no recording of ROS 2 (metadata.yaml, .db3 or .mcap): expected "
                               "such a folder, or a bag file of ROS 1");
    }
  }
  const auto ros2 = std::find_if(paths.begin(), paths.end(), is_rosbag2);
  if (ros2 != paths.end() && paths.size() > 1) {
    throw std::runtime_error(*ros2 + ": is a recording of ROS 2: expected a single --bag");
  }
}

inline bool are_of_ros2(const std::vector<std::string>& paths) {
  return paths.size() == 1 && is_rosbag2(paths.front());
}

inline std::unique_ptr<ImageSource> open_bags(const std::vector<std::string>& paths,
                                              const std::string& image_topic, const GreyLevels& levels) {
  if (are_of_ros2(paths)) {
    auto recording = std::make_unique<Rosbag2ImageSource>(paths.front(), image_topic);
    recording->set_levels(levels);
    return recording;
  }
  auto bags = std::make_unique<BagImageSource>(paths, image_topic);
  bags->set_levels(levels);
  return bags;
}

inline void look_at_first_of_bags(const std::vector<std::string>& paths, const std::string& image_topic,
                                  GreyLevelChoice* levels) {
  if (are_of_ros2(paths)) return Rosbag2ImageSource(paths.front(), image_topic).look_at_first(levels);
  BagImageSource(paths, image_topic).look_at_first(levels);
}

inline std::string topic_of_bags(const std::vector<std::string>& paths, const std::string& image_topic) {
  if (are_of_ros2(paths)) return Rosbag2ImageSource(paths.front(), image_topic).topic();
  return BagImageSource(paths, image_topic).topic();
}

/// As BagImageSource::read_calibration.
inline ConvertedCamera calibration_of_bags(const std::vector<std::string>& paths,
                                           const std::string& image_topic,
                                           const std::string& camera_info_topic,
                                           const std::string& rectified) {
  if (are_of_ros2(paths)) {
    return Rosbag2ImageSource(paths.front(), image_topic).read_calibration(camera_info_topic, rectified);
  }
  return BagImageSource(paths, image_topic).read_calibration(camera_info_topic, rectified);
}

}  // namespace mono_pose_tracker
