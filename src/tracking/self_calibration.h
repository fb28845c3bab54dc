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

/// When a calibration is reported as wrong.
struct CalibrationDoubtOptions {
  /// Minimum relative change of the focal length. On parts of recordings the images suggest focal lengths up
  /// to 6 % off a right calibration: rolling shutter and unmodelled distortion affect all features in common,
  /// which the covariance does not contain. A stabiliser's crop, zoom, binning or another camera's file are
  /// off by more.
  double min_focal_change = 0.1;
  double min_focal_sigmas = 10;
  int landmarks = 60;  // of each keyframe: enough to show such a change
  /// Minimum displacement of the image corners by the refinement, as a share of their distance from the
  /// centre. On parts of recordings right calibrations are off by up to 2.7 %; distortion that is corrected
  /// twice, or not at all, by 10 % or more.
  double min_distortion_share = 0.05;
  double min_distortion_sigmas = 10;   // as for the focal length
  double left_of_rectified = 1.0 / 3;  // most of the calibration's distortion that rectified images have
  double telling_sigmas = 3;           // a part of the recording contradicts the calibration only where it
                                       // can determine it this well,
  double least_of_change = 0.5;        // and suggests less than this share of the change
};

/// When the camera has converged. Changes of the focal length are relative.
struct SelfCalibrationOptions {
  /// Enough keyframes to determine the focal length, where that is possible, and few enough to be tracked in
  /// seconds.
  int early_keyframes = 25;
  int max_early_runs = 5, max_runs = 4;  // from 30 % off, two or three runs converge
  double near_change = 0.01;             // the early runs need to be near only
  /// With few views the estimate oscillates by one per cent about the right camera; larger changes are not
  /// converged. Also in units of the image's longer side, at its edge.
  double unsettled_change = 0.02;
  double settled_shift_px = 1;    // localisation error of a feature
  double settled_change = 0.003;  // a third of the one per cent accuracy of a refined focal length
  double wrong_guess = 0.05;      // least change of a guessed focal length that is corrected
  CalibrationDoubtOptions doubt;
};

/// Alternates tracking and camera refinement until the camera converges: points or parts that a map has lost
/// to a wrong camera are not recovered by adjusting that map. The first runs use the beginning of the
/// recording, which is fast and where a map stays connected even with a focal length that is off by a third.
/// Where there is no map at all, other focal lengths are tried. The last call of `track` is with the returned
/// camera and the whole recording.
SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track,
                                      const SelfCalibrationOptions& limits = {});

/// A message for the user where a map contradicts the calibration with which it was made; else empty. Names
/// the distortion where it is the likely cause: rectified images that are undistorted again.
std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map, const CalibrationDoubtOptions& limits = {});

}  // namespace mono_pose_tracker
