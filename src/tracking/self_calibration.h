#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/map/map.h"
#include "optimization/camera_refinement.h"

namespace mono_pose_tracker {

/// Tracks the recording with this camera. The returned map (null: none) is valid until the next call.
/// max_keyframes: number of keyframes that suffice, the rest of the recording may be skipped; 0: all of it.
using TrackWithCamera = std::function<const Map*(const CameraParameters&, int max_keyframes)>;

struct SelfCalibration {
  CameraParameters camera;  // of the last run
  CalibrationSource source = CalibrationSource::kGiven;
  CameraRefinement last;              // refinement by the last map
  std::vector<std::string> warnings;  // unobservable parameters and the consequences
  /// False: the last run estimates a camera that differs by 2 %, or was interrupted. The map must not be used
  /// then.
  bool is_near = true;
  int runs = 0;
};

/// Alternates tracking and camera refinement until the camera converges: points or parts that a map has lost
/// to a wrong camera are not recovered by adjusting that map. The first runs use the beginning of the
/// recording, which is fast and where a map stays connected even with a focal length that is off by a third.
/// Where there is no map at all, other focal lengths are tried. The last call of `track` is with the returned
/// camera and the whole recording.
SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track);

/// When the distortion of a calibration is reported as wrong.
struct DistortionDoubtOptions {
  /// Minimum displacement of the image corners by the refinement, as a share of their distance from the
  /// centre. On parts of recordings right calibrations are off by up to 2.7 %; distortion that is corrected
  /// twice, or not at all, by 10 % or more.
  double min_share = 0.05;
  double min_sigmas = 10;  // as for a doubtful focal length
};

/// A message for the user where a map contradicts the calibration with which it was made; else empty. Names
/// the distortion where it is the likely cause: rectified images that are undistorted again.
std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map, const DistortionDoubtOptions& distortion = {});

}  // namespace mono_pose_tracker
