#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "camera/camera_parameters.h"
#include "mask_record.h"
#include "mono_pose_tracker/common/status.h"
#include "tracking/recording.h"
#include "tracking/self_calibration.h"

namespace mono_pose_tracker {

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
