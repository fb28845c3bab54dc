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

/// When a calibration is reported as wrong. Changes of the focal length are relative, those of the distortion
/// are displacements of the image corners as a share of their distance from the centre.
struct CalibrationDoubtOptions {
  /// Rate of false alarms of each of the three tests (focal length, distortion, rectified images), among
  /// calibrations within the tolerance; in (0, 1). Nominal: it supposes parts with independent errors.
  double significance = 1e-3;
  /// Error of a right calibration: focusing changes the focal length by one or two per cent.
  double tolerated_change = 0.02;
  /// Least change that is reported: smaller ones hardly distort the path.
  double min_focal_change = 0.05, min_distortion_share = 0.05;
  /// Least additional cost of distortion in rectified images, as AlternativeMapOptions::min_extra_cost.
  double min_extra_cost = 0.1;
  double left_of_rectified = 1.0 / 3;  // most of the calibration's distortion that rectified images have
  double rough_tolerance = 1e-4;       // function_tolerance of these estimates: far below such changes
  int landmarks = 60;                  // of each keyframe: enough to show such a change
  int part_keyframes = 3;              // least of a part of the recording: points need three views
  /// Parts of the recording: as many as there can be. With more than 16, Student's t is nearly normal; of two
  /// it exceeds 600.
  int max_parts = 16, min_parts = 3;
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
  double settled_shift_px = 1;       // localisation error of a feature
  double settled_change = 0.003;     // a third of the one per cent accuracy of a refined focal length
  double wrong_guess = 0.05;         // least change of a guessed focal length that is corrected
  double guess_significance = 0.01;  // of that change: no calibration is at stake
  CalibrationDoubtOptions doubt;
};

/// Alternates tracking and camera refinement until the camera converges: points or parts that a map has lost
/// to a wrong camera are not recovered by adjusting that map. The first runs use the beginning of the
/// recording, which is fast and where a map stays connected even with a focal length that is off by a third.
/// Where there is no map at all, other focal lengths are tried. The last call of `track` is with the returned
/// camera and the whole recording.
SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track);

/// Whether an estimate from the whole recording exceeds the tolerated change in magnitude: Student's t-test.
/// Its covariance takes the errors of all observations for independent. Errors within a part of the recording
/// are not: features drift, an image is blurred, an object is not rigid. The standard deviation is therefore
/// that of the jackknife (Tukey 1958): from the estimates without each of the parts. Where neighbouring parts
/// share an error, it is too small; `sigma`, the standard deviation of what the parts know together, each by
/// itself, is its lower bound. An error that all parts have in common must be tolerated. False for less than
/// min_parts.
bool exceeds(double change, const std::vector<double>& without_part, double sigma, double tolerated,
             const CalibrationDoubtOptions& limits);

/// A message for the user where a map contradicts the calibration with which it was made; else empty. Names
/// the distortion where it is the likely cause: rectified images that are undistorted again.
std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map);

/// The arguments of this test, for another thread.
struct CalibrationTest {
  CameraRefinementOptions options;
  CameraParameters camera;
};

}  // namespace mono_pose_tracker
