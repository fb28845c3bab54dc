#include "mono_pose_tracker/common/scale_source.h"

namespace mono_pose_tracker {

const char* to_string(ScaleSource source) {
  switch (source) {
    case ScaleSource::kMapUnits:
      return "MAP_UNITS";
    case ScaleSource::kKnownBaseline:
      return "KNOWN_BASELINE";
    case ScaleSource::kInitialMedianDepth:
      return "INITIAL_MEDIAN_DEPTH";
    case ScaleSource::kMarker:
      return "MARKER";
    case ScaleSource::kOdometry:
      return "ODOMETRY";
  }
  return "?";
}

}  // namespace mono_pose_tracker
