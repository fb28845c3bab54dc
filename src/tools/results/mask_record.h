#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../json.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// The masks by frame index, compressed, and findings about them.
class MaskRecord {
 public:
  explicit MaskRecord(bool keep) : keep_(keep) {}

  void add(std::int64_t index, const FrameReport& report);
  /// Another one for the frame than was in force.
  void replace(std::int64_t index, const cv::Mat& mask);
  /// Empty where there was none.
  cv::Mat mask(std::int64_t index) const;
  Json summary() const;
  std::size_t frames() const { return shares_.size(); }

 private:
  const bool keep_;
  std::map<std::int64_t, std::string> methods_;
  std::map<std::int64_t, double> shares_;  // of the image that is foreground
  std::map<std::int64_t, std::vector<std::uint8_t>> packed_;
};

}  // namespace mono_pose_tracker
