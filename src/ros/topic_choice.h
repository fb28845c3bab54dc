#pragma once

#include <cstddef>
#include <string>

namespace mono_pose_tracker {

/// Why no image topic of a recording is chosen, and what to do. One line that continues the recording's name
/// and a colon. wanted: the topic that was asked for; empty: any. number, names: of the recording's image
/// topics.
inline std::string why_no_image_topic(const std::string& wanted, std::size_t number,
                                      const std::string& names) {
  if (!wanted.empty()) return "has no images on " + wanted + ": expected one of its image topics: " + names;
  if (number == 0) return "has no image topic";
  return "has " + std::to_string(number) + " image topics: choose one with --image-topic: " + names;
}

}  // namespace mono_pose_tracker
