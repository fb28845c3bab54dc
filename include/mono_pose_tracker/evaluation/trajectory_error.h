#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

/// Positions of one camera that both trajectories know, in the reference's map.
struct MatchedPosition {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d reference = Eigen::Vector3d::Zero();
  Eigen::Vector3d estimate = Eigen::Vector3d::Zero();  // after the alignment
};

/// How far an estimated trajectory is from a reference. Lengths are in the reference's units.
struct TrajectoryError {
  int frames_reference = 0;
  int frames_matched = 0;

  // Positions after the Sim(3) alignment with the least sum of squared distances (Umeyama 1991).
  Sim3 reference_from_estimate;
  double position_rmse = 0;
  double position_median = 0;
  double position_max = 0;
  double path_length = 0;            // over all reference frames from the first to the last matched
  double position_rmse_percent = 0;  // of the path

  // Orientations after the best single rotation between the two sets (chordal L2 mean).
  double rotation_median_deg = 0;
  double rotation_max_deg = 0;

  // Motion from one matched frame to the next, in the camera's frame: no alignment, no scale. The direction
  // is that of the translation; steps in which the reference does not move have none. 180 where only the
  // estimate does not move.
  double relative_rotation_median_deg = 0;
  double relative_direction_median_deg = 0;

  std::vector<MatchedPosition> positions;  // by stamp
  Rigid3 reference_from_first_camera;      // the reference's pose of the first of them
};

/// Compares trajectories, each sorted by stamp. A frame of the estimate belongs to the reference frame
/// nearest in time, if that is at most max_difference_ns away; of two that want the same one the nearer gets
/// it. Throws std::runtime_error, one line, when fewer than three frames match or the positions of one
/// trajectory all coincide.
TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate, std::int64_t max_difference_ns);

}  // namespace mono_pose_tracker
