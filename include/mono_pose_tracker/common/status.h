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

}  // namespace mono_pose_tracker
