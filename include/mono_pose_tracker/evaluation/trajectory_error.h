#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

/// How the estimate is laid over the reference: with a scale, as a single camera needs it, or without.
enum class Alignment { kSim3, kSe3 };

/// The step over which the relative pose error is taken: so many matched frames, or so much of the
/// reference's path, in its units.
struct PoseDelta {
  enum class Unit { kFrames, kLength };
  double size = 1;
  Unit unit = Unit::kFrames;
};

struct EvaluationOptions {
  std::int64_t max_difference_ns = 10'000'000;  // between the stamps of one frame
  Alignment alignment = Alignment::kSim3;
  PoseDelta delta;
};

/// A camera that both trajectories know, in the reference's map.
struct MatchedPosition {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d reference = Eigen::Vector3d::Zero();
  Eigen::Vector3d estimate = Eigen::Vector3d::Zero();  // after the alignment
  double rotation_deg = 0;                             // between the orientations, after theirs
};

/// How far an estimated trajectory is from a reference. Lengths are in the reference's units.
struct TrajectoryError {
  int frames_reference = 0;
  int frames_matched = 0;

  // Positions after the alignment with the least sum of squared distances (Umeyama 1991): the absolute
  // trajectory error (ATE). The scale is 1 where none is sought.
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

  // Relative pose error (RPE; Sturm et al., IROS 2012): the motion over each step of the wanted size, the
  // estimate's in the reference's units.
  int rpe_pairs = 0;
  double rpe_translation_rmse = 0;
  double rpe_rotation_rmse_deg = 0;

  // Drift (as KITTI takes it, but over parts of this path): the same errors over every part that is 10, 20,
  // 30, 40 or 50 % of the path long, divided by its length; the mean.
  double drift_translation_percent = 0;
  double drift_rotation_deg_per_length = 0;

  // How much the estimate's unit is larger over the last quarter of the path than over the first; nothing
  // where one of them has too little motion to tell.
  std::optional<double> scale_drift_percent;

  std::vector<MatchedPosition> positions;  // by stamp
  // To look at: from the first of them, y down as the cameras have it on average, z forward.
  Rigid3 reference_from_view;
};

/// Compares trajectories, each sorted by stamp. A frame of the estimate belongs to the reference frame
/// nearest in time, if that is not too far away; of two that want the same one the nearer gets
/// it. Throws std::runtime_error, one line, when fewer than three frames match or the positions of one
/// trajectory all coincide.
TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate,
                                    const EvaluationOptions& options);
TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate, std::int64_t max_difference_ns);

/// What one picture of several maps of a recording needs, each map having been aligned by itself.
TrajectoryError united(const std::vector<TrajectoryError>& errors);

}  // namespace mono_pose_tracker
