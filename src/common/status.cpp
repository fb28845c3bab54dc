#include "mono_pose_tracker/common/status.h"

namespace mono_pose_tracker {

const char* to_string(State state) {
  switch (state) {
    case State::kWaitingForCameraInfo:
      return "WAITING_FOR_CAMERA_INFO";
    case State::kBootstrapping:
      return "BOOTSTRAPPING";
    case State::kTracking:
      return "TRACKING";
    case State::kLost:
      return "LOST";
    case State::kPaused:
      return "PAUSED";
  }
  return "UNKNOWN";
}

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::kOk:
      return "OK";
    case Reason::kNoCameraInfo:
      return "NO_CAMERA_INFO";
    case Reason::kUncalibrated:
      return "UNCALIBRATED";
    case Reason::kImageSizeMismatch:
      return "IMAGE_SIZE_MISMATCH";
    case Reason::kUnsupportedEncoding:
      return "UNSUPPORTED_ENCODING";
    case Reason::kStaleStamp:
      return "STALE_STAMP";
    case Reason::kDropped:
      return "DROPPED";
    case Reason::kTooFewFeatures:
      return "TOO_FEW_FEATURES";
    case Reason::kTooFewMatches:
      return "TOO_FEW_MATCHES";
    case Reason::kLowParallax:
      return "LOW_PARALLAX";
    case Reason::kRotationOnly:
      return "ROTATION_ONLY";
    case Reason::kAmbiguousPose:
      return "AMBIGUOUS_POSE";
    case Reason::kTooFewInliers:
      return "TOO_FEW_INLIERS";
    case Reason::kRelocalising:
      return "RELOCALISING";
    case Reason::kFirstFrame:
      return "FIRST_FRAME";
    case Reason::kAwaitingConfirmation:
      return "AWAITING_CONFIRMATION";
    case Reason::kPaused:
      return "PAUSED";
    case Reason::kUnreadableImage:
      return "UNREADABLE_IMAGE";
    case Reason::kTimeJump:
      return "TIME_JUMP";
    case Reason::kInternalError:
      return "INTERNAL_ERROR";
    case Reason::kLearningBackground:
      return "LEARNING_BACKGROUND";
    case Reason::kStillBackground:
      return "STILL_BACKGROUND";
    case Reason::kDoubtfulPose:
      return "DOUBTFUL_POSE";
    case Reason::kNotRigid:
      return "NOT_RIGID";
    case Reason::kCalibrationChanged:
      return "CALIBRATION_CHANGED";
  }
  return "UNKNOWN";
}

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
