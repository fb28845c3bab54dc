#pragma once

#include <functional>
#include <limits>
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
  /// Share of right calibrations that are reported as wrong, of focal lengths and of distortions; in (0, 1).
  double significance = 1e-3;
  /// Error of a right calibration: focusing changes the focal length by one or two per cent.
  double tolerated_change = 0.02;
  /// Least change that is reported: smaller ones hardly distort the path.
  double min_focal_change = 0.05, min_distortion_share = 0.05;
  int landmarks = 60;      // of each keyframe: enough to show such a change
  double rough_tolerance = 1e-4;  // of the cost, until such a change shows
  int part_keyframes = 3;  // least of a part of the recording: points need three views
  /// Parts of the recording: as many as there can be, or half as many again and again where more of them
  /// determine the change. With more than 16, Student's t is nearly normal; of two it exceeds 600.
  int max_parts = 16, min_parts = 3;
  /// Ratio of the scatter between parts to the covariance's, before a recording shows its own: the median of
  /// 70 maps from 10 recordings (4 to 16 parts). It counts as one part.
  double usual_scatter = 2.35;
  double left_of_rectified = 1.0 / 3;  // most of the calibration's distortion that rectified images have
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

/// Estimated change of a parameter, with its standard deviation by the covariance.
struct EstimatedChange {
  double change = 0, sigma = std::numeric_limits<double>::infinity();
};

/// Whether an estimate from the whole recording exceeds the tolerated change in magnitude. The covariance
/// takes the errors of all observations for independent. Errors along a track or within a part of the
/// recording are not: features drift, an image is blurred, a lens or an object is not as modelled. Estimates
/// from separate parts then differ from that of the whole by more than their covariances. The mean square
/// of these differences multiplies the variance (Birge, Phys. Rev. 40, 1932; quasi-likelihood: Wedderburn,
/// Biometrika 61, 1974), together with the usual one (moderated t: Smyth, Stat. Appl. Genet. Mol. Biol. 3,
/// 2004): the quotient has Student's distribution. False for less than two parts. An error that all parts
/// have in common must be tolerated.
bool exceeds(const EstimatedChange& whole, const std::vector<EstimatedChange>& parts, double tolerated,
             const CalibrationDoubtOptions& limits);

/// A message for the user where a map contradicts the calibration with which it was made; else empty. Names
/// the distortion where it is the likely cause: rectified images that are undistorted again.
std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map, const CalibrationDoubtOptions& limits = {});

/// The arguments of this test, for another thread.
struct CalibrationTest {
  CameraRefinementOptions options;
  CameraParameters camera;
};

}  // namespace mono_pose_tracker
