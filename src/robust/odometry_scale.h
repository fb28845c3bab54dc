#pragma once

#include <cmath>
#include <cstddef>
#include <deque>
#include <optional>

#include "common/rotation.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

struct OdometryScaleOptions {
  double segment_metres = 0.15;   // m: long compared with the millimetres between an encoder's ticks, short
                                  // enough for ten segments in a metre and a half
  std::size_t min_segments = 10;  // with fewer their spread is uncertain
  std::size_t max_segments = 40;  // that are kept: six metres. The scale may have drifted since older ones
  double min_cosine = std::cos(20 * kDegree);  // of the angle between the two directions of one motion;
                                               // beyond it the segment is an outlier
  double min_units = 1e-6;  // map units. A camera that hardly moves in the map while odometry advances is not
                            // carried by the robot
  double max_sigma = 0.01;  // relative, one standard deviation of a scale that is applied
  double max_off = 0.03;    // relative error of a metric map up to which it is kept
  double max_followed = 0.01;  // logarithm of a correction's scale: followed wrongly, it does no more harm
                               // than a first estimate's own error (max_sigma)
};

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

  explicit OdometryScale(const OdometryScaleOptions& options = {}) : options_(options) {}

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

  /// Factor to apply to the map now: once when one standard deviation falls below max_sigma, and again when
  /// a metric map is off by more than max_off. Nothing otherwise.
  std::optional<double> correction(bool is_metric) const;

 private:
  struct Pair {
    Rigid3 odom_from_camera, map_from_camera;
  };
  struct Segment {
    double log_ratio = 0;  // of metres to units
    bool agrees = false;   // in direction
  };

  OdometryScaleOptions options_;
  std::optional<Pair> begin_;
  std::deque<Segment> segments_;
};

}  // namespace mono_pose_tracker
