#pragma once

#include <deque>
#include <optional>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// Estimates metres per map unit by comparing the path of odometry with that of the camera in the map. The
/// path is cut into segments of equal odometry length, so that drift of odometry between segments does not
/// matter. The median over segments is robust against slipping wheels and jumps.
///
/// Give the camera's pose in odometry's frame, not the base's: a base that turns on the spot moves a camera
/// that it carries off its axis.
class OdometryScale {
 public:
  struct Estimate {
    double metres_per_unit = 1;
    double sigma = 0;  // relative, one standard deviation
    int segments = 0;
  };

  /// Both of the same image. Poses of another map need a restart before.
  void add(const Rigid3& odom_from_camera, const Rigid3& map_from_camera);
  void restart();
  /// Reports a correction of the map that multiplied the lengths around the camera by this factor. Existing
  /// measurements are rescaled after a small correction. Returns false after a large one, which may differ
  /// elsewhere; measuring then restarts.
  bool follow(double length_scale);
  /// Starts a new segment: the camera was lost, or odometry was missing for an image.
  void interrupt() { begin_.reset(); }

  /// The scale; nothing with too few segments, or when most directions disagree. In that case the two are not
  /// of the same camera, or the transform from base to camera is wrong.
  std::optional<Estimate> estimate() const;

  /// Factor to apply to the map now: once when one standard deviation falls below 1 %, and again when a
  /// metric map is off by more than 3 %. Nothing otherwise.
  std::optional<double> correction(bool is_metric) const;

 private:
  struct Pair {
    Rigid3 odom_from_camera, map_from_camera;
  };
  struct Segment {
    double log_ratio = 0;  // of metres to units
    bool agrees = false;   // in direction
  };

  std::optional<Pair> begin_;
  std::deque<Segment> segments_;
};

}  // namespace mono_pose_tracker
