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

/// The masks in force, by the frames' indices, packed, until others replace them; and what they say of the
/// recording.
class MaskRecord {
 public:
  explicit MaskRecord(bool keep) : keep_(keep) {}

  void add(std::int64_t index, const FrameReport& report);
  /// Another one for the frame; the summary stays that of the masks in force.
  void replace(std::int64_t index, const cv::Mat& mask);
  /// Empty where there was none.
  cv::Mat mask(std::int64_t index) const;
  Json summary() const;
  /// How many frames have one; none, where they are not kept.
  std::size_t frames() const { return packed_.size(); }

 private:
  const bool keep_;
  std::map<std::string, int> frames_;
  std::map<std::int64_t, std::vector<std::uint8_t>> packed_;
  double share_ = 0;
  int masks_ = 0;
};

}  // namespace mono_pose_tracker
