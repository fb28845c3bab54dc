#include "ros/frame_options.h"

#include <map>

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
