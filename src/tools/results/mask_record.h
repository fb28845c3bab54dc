#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../json.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// The masks in force, by the frames' indices, packed; and what they say of the recording.
class MaskRecord {
 public:
  explicit MaskRecord(bool keep) : keep_(keep) {}

  void add(std::int64_t index, const FrameReport& report);
  /// Empty where there was none.
  cv::Mat mask(std::int64_t index) const;
  Json summary() const;

 private:
  const bool keep_;
  std::map<std::string, int> frames_;
  std::map<std::int64_t, std::vector<std::uint8_t>> packed_;
  double share_ = 0;
  int masks_ = 0;
};

}  // namespace mono_pose_tracker
