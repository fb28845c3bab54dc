#include "mono_pose_tracker/common/calibration_source.h"

namespace mono_pose_tracker {

const char* to_string(CalibrationSource source) {
  switch (source) {
    case CalibrationSource::kGiven:
      return "GIVEN";
    case CalibrationSource::kGuessed:
      return "GUESSED";
    case CalibrationSource::kRefined:
      return "REFINED";
  }
  return "?";
}

}  // namespace mono_pose_tracker
