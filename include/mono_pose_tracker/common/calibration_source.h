#pragma once

namespace mono_pose_tracker {

/// Where the intrinsics come from. The numbers are those of TrackerStatus.msg; new ones go at the end.
enum class CalibrationSource {
  kGiven = 0,    // a calibration: a file, a CameraInfo
  kGuessed = 1,  // the field of view was guessed, nothing else is known
  kRefined = 2,  // adjusted together with poses and points
};

/// "GIVEN", "GUESSED", "REFINED": the spelling of TrackerStatus.msg and report.json.
const char* to_string(CalibrationSource source);

}  // namespace mono_pose_tracker
