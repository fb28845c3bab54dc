#include "camera/rectification.h"

#include <algorithm>
#include <array>

namespace mono_pose_tracker {
namespace {

/// The last part of the topic, by image_transport's rules: /camera/image_rect/compressed -> image_rect.
std::string base_name(std::string topic) {
  const auto last_part = [&] { return topic.substr(topic.rfind('/') + 1); };
  constexpr std::array transports{"compressed", "compressedDepth", "theora"};
  while (!topic.empty() && topic.back() == '/') topic.pop_back();
  const std::string last = last_part();
  const bool is_transport = std::any_of(transports.begin(), transports.end(),
                                        [&](const char* transport) { return last == transport; });
  if (is_transport && topic.find('/') != std::string::npos) topic.resize(topic.rfind('/'));
  return last_part();
}

bool begins_with(const std::string& text, const std::string& beginning) {
  return text.rfind(beginning, 0) == 0;
}

bool is_rectified_by_name(const std::string& topic) { return begins_with(base_name(topic), "image_rect"); }

/// What drivers and image_proc call images that are not rectified.
bool is_raw_by_name(const std::string& topic) {
  constexpr std::array names{"image_raw", "image_mono", "image_color"};
  const std::string name = base_name(topic);
  return std::any_of(names.begin(), names.end(), [&](const char* raw) { return begins_with(name, raw); });
}

}  // namespace

Rectification decide_rectification(const std::string& setting, const std::string& image_topic) {
  if (setting == "true") return {true, "rectified is set to true"};
  if (setting == "false") return {false, "rectified is set to false"};
  if (image_topic.empty()) return {false, "rectified is auto, and image files are assumed to be raw"};
  if (is_rectified_by_name(image_topic)) {
    return {true, "rectified is auto, and the name of " + image_topic + " begins with image_rect"};
  }
  return {false, "rectified is auto, and the name of " + image_topic + " does not begin with image_rect"};
}

std::string rectification_contradiction(const std::string& setting, const std::string& image_topic,
                                        bool has_distortion) {
  if (!has_distortion || image_topic.empty()) return "";
  if (setting == "true" && is_raw_by_name(image_topic)) {
    return "rectified is set to true, but " + image_topic +
           " is a topic name of raw images, and the calibration has distortion: the map is distorted if the "
           "images are raw. Set rectified to auto";
  }
  if (setting == "false" && is_rectified_by_name(image_topic)) {
    return "rectified is set to false, but " + image_topic +
           " is a topic name of rectified images, and the calibration has distortion: the map is distorted "
           "if they are undistorted twice. Set rectified to auto";
  }
  return "";
}

}  // namespace mono_pose_tracker
