#pragma once

#include <string>
#include <vector>

namespace mono_pose_tracker {

/// Whether images are rectified already: then P of the calibration holds, and no distortion.
struct Rectification {
  bool is_rectified = false;
  std::string reason;  // one line: who decided so
};

/// Values of the option `rectified`, the default first.
inline const std::vector<std::string> kRectifiedSettings = {"auto", "true", "false"};

/// Decides for recordings and for live images. setting: one of kRectifiedSettings. auto: rectified if the
/// base name of the topic begins with image_rect (/camera/image_rect_color, also its /compressed).
/// image_topic: empty for files, which auto treats as raw images.
Rectification decide_rectification(const std::string& setting, const std::string& image_topic);

/// A one-line warning if the setting contradicts the topic or calibration, with what to do; empty: none.
/// has_distortion: the calibration has non-zero coefficients, so that raw and rectified images differ.
std::string rectification_contradiction(const std::string& setting, const std::string& image_topic,
                                        bool has_distortion);

}  // namespace mono_pose_tracker
