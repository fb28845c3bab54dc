#pragma once

#include <functional>
#include <limits>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// One standard deviation of a focal length that counts as observable, relative: 1 % is more than three of
/// them.
inline constexpr double kMaxFocalSigma = 0.003;

struct CameraRefinementOptions {
  /// Cauchy loss, in sigmas, times the residuals' own spread; 0: squared loss.
  double loss_width = 2.0;
  int num_threads = 1;  // Ceres does not repeat its sums on more than one
  /// Asked after every iteration of a solve; once it is true, nothing more is refined.
  std::function<bool()> cancel;
  /// Of a longer recording, so many keyframes from the middle on are taken: the reduced system is dense.
  int max_keyframes = 150;
  int max_landmarks = 200;  // of each keyframe: those that most keyframes see
  /// Of those keyframes, by time, the part between these shares of them.
  double begin = 0, end = 1;
};

/// What the views of a map say of the camera that made them.
struct CameraRefinement {
  /// What the motion lets the views tell; what it does not keeps the value it had.
  bool focal_observable = false, center_observable = false, distortion_observable = false;
  CameraParameters camera;
  /// Relative, one standard deviation; infinite where nothing tells it.
  double focal_sigma = std::numeric_limits<double>::infinity();
  double focal_change = 0;  // relative: what came out over what was given, less 1
  double focal_asked = 0;   // as focal_change, of the focal length alone; whether it is observable or not
  /// Change of the radial distortion, whether it is observable or not: how far it moves the image's corners
  /// beyond what a longer or shorter focal length would [px], with one standard deviation.
  double distortion_asked_px = 0;
  double distortion_sigma_px = std::numeric_limits<double>::infinity();
  double max_shift_px = 0;  // the farthest that a pixel of the image's edge moved
};

/// Bundle adjustment of poses, points and one camera for all views (focal length, principal point, k1, k2).
/// What is refined is decided by its covariance, marginal over poses and points: parameters that the motion
/// leaves open (a camera that only goes forward, or a plane seen from straight above) stay as they were. The
/// map is left as it is: only a new run with the new camera gives it all that was lost to the old one.
CameraRefinement refine_camera(const CameraRefinementOptions& options, const CameraParameters& camera,
                               const Map& map);

}  // namespace mono_pose_tracker
