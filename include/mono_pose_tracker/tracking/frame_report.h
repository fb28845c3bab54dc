#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/colored_point.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/common/status.h"

namespace mono_pose_tracker {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// What became of one image.
struct FrameReport {
  std::int64_t stamp_ns = 0;
  State state = State::kBootstrapping;
  Reason reason = Reason::kOk;
  std::string reason_text;  // the reason with its numbers, one line
  std::uint32_t epoch = 0;  // counts maps: grows when a map is dropped

  std::optional<Rigid3> map_from_camera;  // empty while there is no pose
  /// Of map_from_camera as ROS defines it: x y z (map units) and rotations about the map's fixed axes (rad).
  Matrix6d covariance = Matrix6d::Zero();
  bool is_keyframe = false;

  int features = 0;
  int matches = 0;
  int inliers = 0;
  double median_parallax_deg = 0;
  double reprojection_rms_px = 0;
  int keyframes = 0;
  int landmarks = 0;
  int worker_backlog = 0;  // keyframes that wait for the mapper
  StageTimes stages;
};

struct PosedFrame {
  std::int64_t index = 0;
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

struct KeyframePose {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

/// A copy of the map to publish or write, consistent in itself.
struct MapSnapshot {
  std::uint32_t epoch = 0;
  std::uint64_t revision = 0;  // grows with every change of the map
  std::vector<ColoredPoint> points;
  std::vector<KeyframePose> keyframes;  // by stamp
};

}  // namespace mono_pose_tracker
