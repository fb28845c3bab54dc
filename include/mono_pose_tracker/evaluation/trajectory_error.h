#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

/// Alignment of the estimate to the reference: with scale, as for a single camera, or without.
enum class Alignment { kSim3, kSe3 };

/// Step of the relative pose error: a number of matched frames, or a length of the reference's path in its
/// units.
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

/// A camera in both trajectories, in the reference's map.
struct MatchedPosition {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d reference = Eigen::Vector3d::Zero();
  Eigen::Vector3d estimate = Eigen::Vector3d::Zero();  // after the alignment
  double rotation_deg = 0;                             // between the orientations, after theirs
};

/// Errors of an estimated trajectory against a reference. Lengths are in the reference's units.
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

  // Relative increase of the estimate's scale from the first to the last quarter of the path; nothing if
  // either has too little motion.
  std::optional<double> scale_drift_percent;

  std::vector<MatchedPosition> positions;  // by stamp
  // To look at: from the first of them, y down as the cameras have it on average, z forward.
  Rigid3 reference_from_view;
};

/// Compares trajectories, each sorted by stamp. A frame of the estimate is matched with the reference frame
/// nearest in time within the tolerance; of two candidates the nearer one is taken. Throws
/// std::runtime_error, one line, when fewer than three frames match or the positions of one trajectory all
/// coincide.
TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate,
                                    const EvaluationOptions& options);
TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate, std::int64_t max_difference_ns);

/// Input for one picture of several maps of a recording, each aligned by itself.
TrajectoryError united(const std::vector<TrajectoryError>& errors);

}  // namespace mono_pose_tracker
