#pragma once

#include <string>
#include <vector>

namespace mono_pose_tracker {

/// Whether images are rectified already: then P of the calibration holds, and no distortion.
struct Rectification {
  bool is_rectified = false;
  std::string reason;  // one line: who decided so
};

/// Values of the setting `rectified`, the default first.
inline const std::vector<std::string> kRectifiedSettings = {"auto", "true", "false"};

/// The one rule for recordings and live images. setting: one of kRectifiedSettings; auto: rectified where the
/// base name of the topic begins with image_rect (/camera/image_rect_color, and its /compressed).
/// image_topic: empty for files, which auto takes for raw images.
Rectification decide_rectification(const std::string& setting, const std::string& image_topic);

/// What speaks against the setting, in one line with what to do; empty: nothing. has_distortion: the
/// calibration has coefficients that are not zero, so that raw and rectified images differ.
std::string rectification_contradiction(const std::string& setting, const std::string& image_topic,
                                        bool has_distortion);

}  // namespace mono_pose_tracker
