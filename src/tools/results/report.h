#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../json.h"
#include "camera/camera_parameters.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "pipeline/recording.h"
#include "pipeline/self_calibration.h"

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

/// The calibration used for the results.
struct Calibration {
  CameraParameters camera;
  CalibrationSource source = CalibrationSource::kGiven;
  std::optional<SelfCalibration> refined;
  std::optional<Rectification> rectification;  // of a guess: nothing
  std::string contradiction;  // what the images say against it, for a warning; empty: nothing
  std::string size_origin;    // ConvertedCamera
  std::string note;           // about ignored entries of the calibration
};

/// report.json: the result of the recording. `alignment`: to given positions; null: none were given.
void write_report(const std::string& path, const RecordingResult& result, const Map& map,
                  const MaskRecord& masks, const Calibration& calibration, const Json& alignment,
                  std::uint64_t seed, double wall_seconds);

}  // namespace mono_pose_tracker
