#pragma once

namespace mono_pose_tracker {

/// What the tracker is doing. The numbers are those of TrackerStatus.msg.
enum class State { kWaitingForCameraInfo = 0, kBootstrapping = 1, kTracking = 2, kLost = 3, kPaused = 4 };

/// Why a frame has the result it has. The numbers are those of TrackerStatus.msg; new ones go at the end.
enum class Reason {
  kOk = 0,
  kNoCameraInfo,
  kUncalibrated,
  kImageSizeMismatch,
  kUnsupportedEncoding,
  kStaleStamp,
  kDropped,
  kTooFewFeatures,
  kTooFewMatches,
  kLowParallax,
  kRotationOnly,
  kAmbiguousPose,
  kTooFewInliers,
  kRelocalising,
  kFirstFrame,
  kAwaitingConfirmation,
  kPaused,
  kUnreadableImage,
  kTimeJump,
  kInternalError,
  kLearningBackground,
  kStillBackground,
  kDoubtfulPose,
  kNotRigid,
  kCalibrationChanged,
};

/// "TRACKING", "LOW_PARALLAX", ...: the spelling of TrackerStatus.msg.
const char* to_string(State state);
const char* to_string(Reason reason);

/// Where the intrinsics come from. The numbers are those of TrackerStatus.msg; new ones go at the end.
enum class CalibrationSource {
  kGiven = 0,    // a calibration: a file, a CameraInfo
  kGuessed = 1,  // the field of view was guessed, nothing else is known
  kRefined = 2,  // adjusted together with poses and points
};

/// "GIVEN", "GUESSED", "REFINED": the spelling of TrackerStatus.msg and report.json.
const char* to_string(CalibrationSource source);

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
