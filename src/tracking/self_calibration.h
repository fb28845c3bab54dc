#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/map/map.h"
#include "optimization/camera_refinement.h"

namespace mono_pose_tracker {

/// Tracks the recording with this camera; the map (null: none could be made) is kept until the next call.
/// max_keyframes: that many are enough, the rest of the recording may be left; 0: all of it.
using TrackWithCamera = std::function<const Map*(const CameraParameters&, int max_keyframes)>;

struct SelfCalibration {
  CameraParameters camera;  // with which the recording was tracked last
  CalibrationSource source = CalibrationSource::kGiven;
  CameraRefinement last;              // what the last map says of it
  std::vector<std::string> warnings;  // what was not observable, and what follows
  /// False: the last run asks for one that is 2 % off, or was interrupted; nothing is to be built on it.
  bool is_near = true;
  int runs = 0;
};

/// Tracks and refines in turn until the camera changes no more: what a map has lost to a wrong camera (points
/// culled, whole parts), no adjustment of that map gives back. First with the beginning of the recording,
/// which is soon done and where a map holds together even with a focal length that is off by a third; where
/// there is no map at all, with other focal lengths. The last call of `track` is with the camera that is
/// returned, and of all of the recording.
SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track);

/// When the distortion of a calibration counts as wrong.
struct DistortionDoubtOptions {
  /// The least that the images move its corners by, as a share of the corners' distance from the centre.
  /// On parts of recordings right calibrations are off by up to 2.7 %; distortion that is undistorted twice,
  /// or not at all, is 10 % and more.
  double min_share = 0.05;
  double min_sigmas = 10;  // as of a focal length that is doubtful
};

/// A line for the user where a map says that the calibration it was made with is wrong; else nothing. The
/// distortion is named where it is the suspect: of images that are rectified already, and undistorted again.
std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map, const DistortionDoubtOptions& distortion = {});

}  // namespace mono_pose_tracker
