#pragma once

#include <functional>
#include <limits>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Largest relative standard deviation of an observable focal length: three of them are below 1 %.
inline constexpr double kMaxFocalSigma = 0.003;

struct CameraRefinementOptions {
  /// Cauchy loss, in sigmas, times the residuals' own spread; 0: squared loss.
  double loss_width = 2.0;
  int num_threads = 1;  // Ceres does not repeat its sums on more than one
  /// Called after every iteration of a solve; true: nothing more is refined.
  std::function<bool()> cancel;
  double function_tolerance = 1e-6;  // relative change of the cost at which a solve ends
  /// Number of keyframes used, from the middle of a longer recording: the reduced system is dense.
  int max_keyframes = 150;
  int max_landmarks = 200;  // of each keyframe: those that most keyframes see
  /// The part of these keyframes, by time, between these shares of them; or all the others.
  double begin = 0, end = 1;
  bool is_part_excluded = false;
  /// If the estimated changes are smaller than both, no refinement follows: only these changes are reported.
  double least_focal_change = 0;   // relative
  double least_distortion_px = 0;  // as CameraRefinement::distortion_asked_px
};

/// Camera parameters estimated from the views of a map.
struct CameraRefinement {
  /// The refined camera; parameters that the motion leaves unobservable keep their values.
  bool focal_observable = false, center_observable = false, distortion_observable = false;
  CameraParameters camera;
  /// Relative standard deviation; infinite if unobservable.
  double focal_sigma = std::numeric_limits<double>::infinity();
  double focal_change = 0;  // relative: what came out over what was given, less 1
  double focal_asked = 0;   // as focal_change, of the focal length alone; whether it is observable or not
  double focal_asked_sigma = std::numeric_limits<double>::infinity();  // its standard deviation
  /// Change of the radial distortion, whether observable or not: shift of the image corners beyond that of a
  /// change of focal length [px], with one standard deviation.
  double distortion_asked_px = 0;
  double distortion_sigma_px = std::numeric_limits<double>::infinity();
  double max_shift_px = 0;  // the farthest that a pixel of the image's edge moved
};

/// Bundle adjustment of poses, points and one camera for all views (focal length, principal point, k1, k2).
/// The covariance, marginal over poses and points, decides which parameters are refined: those that the
/// motion leaves unobservable (pure forward motion, a plane viewed perpendicularly) keep their values. The
/// map is not changed; track again with the new camera to benefit from it.
CameraRefinement refine_camera(const CameraRefinementOptions& options, const CameraParameters& camera,
                               const Map& map);

/// Probability that `camera` fits a map so much worse than `alternative` by chance, if it were no worse:
/// poses, points and focal length are adjusted with either, and Student's t-test compares the landmarks'
/// costs (p_value_of_extra_cost). 1 where its cost is not higher by min_extra_cost, a share of the
/// alternative's, or nothing can be adjusted.
double p_value_of_worse_fit(const CameraRefinementOptions& options, const CameraParameters& camera,
                            const CameraParameters& alternative, const Map& map, double min_extra_cost);

}  // namespace mono_pose_tracker
