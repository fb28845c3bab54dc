#pragma once

namespace mono_pose_tracker {

/// What the unit of a map's lengths rests on. The numbers are those of TrackerStatus.msg and of map files;
/// new ones go at the end.
enum class ScaleSource {
  kMapUnits = 0,            // nothing is known: the median depth of the first view's points is 1
  kKnownBaseline = 1,       // metres: the distance between the two bootstrap cameras was given
  kInitialMedianDepth = 2,  // metres: the median depth of the first view's points was given
  kMarker = 3,              // metres: a marker of known size was in view
  kOdometry = 4,            // metres: the distance that odometry says was travelled
};

/// "MAP_UNITS", "KNOWN_BASELINE", ...: the spelling of TrackerStatus.msg.
const char* to_string(ScaleSource source);

}  // namespace mono_pose_tracker
