#pragma once

#include <deque>
#include <optional>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// Metres per map unit, from what odometry says of the way that the camera went in the map. The way is cut
/// into segments of odometry's own length, each compared by itself, so that what odometry drifts from one to
/// the next does not matter; their median stands against slipping wheels and jumps.
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
  /// The map was corrected, and its lengths were multiplied by this where the camera is. What was measured
  /// follows a small change. False: it was a large one, which may be another elsewhere; measuring restarts.
  bool follow(double length_scale);
  /// The next segment begins anew: the camera was lost, or odometry had nothing to say of an image.
  void interrupt() { begin_.reset(); }

  /// Nothing while there are too few segments, or when most contradict each other in direction: then the two
  /// are not of the same camera, or the transform from base to camera is wrong.
  std::optional<Estimate> estimate() const;

  /// By what the map should be multiplied now: once as soon as one standard deviation is below 1 %, and again
  /// when a map that is in metres already is off by more than 3 %. Nothing otherwise.
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
