#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "mono_pose_tracker/geometry/sim3.h"

namespace mono_pose_tracker {

/// A camera position in the map, and as measured in the world (m).
struct PositionPair {
  Eigen::Vector3d in_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
};

/// A direction known in both frames. It determines the rotation about the path where positions near one line
/// do not. Unit vectors.
struct DirectionPair {
  Eigen::Vector3d in_map = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d in_world = Eigen::Vector3d::UnitZ();
};

struct PositionAlignmentOptions {
  std::uint64_t seed = 0;
  /// Samples of three positions that are tried. 500 find three good ones among 50 % outliers with a
  /// probability of 1 - 1e-29; the rest allows for samples that noise makes useless.
  int samples = 2000;
  /// Positions that score a sample, at most; of more, evenly spread ones.
  int max_scored = 1000;
  /// Largest squared distance of an inlier in units of the noise's variance per axis: the 99 % quantile of
  /// chi-squared with three degrees of freedom.
  double max_squared_error = 11.345;
  /// The noise level is larger by the factor 1 + small_sample / (n - 3) for n positions (Rousseeuw and Leroy
  /// 1987, chapter 5).
  double small_sample = 5;
  /// Smallest number of inliers; fewer fit accidentally.
  int min_inliers = 4;
  /// Smallest share of inliers; the median of the errors is meaningless below one half.
  double min_inlier_share = 0.5;
  /// Smallest noise in units of the world's extent: rounding errors of an exact fit.
  double min_relative_sigma = 1e-9;
  /// Least-squares fits, each on the inliers of the one before; they settle after a few.
  int max_refinements = 30;
  /// Relative standard deviation of the scale above which the alignment fails.
  double max_scale_sigma = 0.1;
  /// Standard deviation (deg) about the worst axis above which the known directions are used.
  double max_rotation_sigma_deg = 2;
  /// Largest angle (deg) between a known direction and the aligned one; beyond it they contradict.
  double max_direction_angle_deg = 10;
};

struct PositionAlignment {
  bool success = false;
  std::string problem;  // why not, and what was expected
  Sim3 world_from_map;
  std::vector<char> inliers;   // a flag a pair
  std::vector<double> errors;  // m, a distance a pair
  int num_inliers = 0;
  double inlier_rms = 0;          // m
  double sigma = 0;               // m per axis: of noise and drift together, by the inliers
  double rotation_sigma_deg = 0;  // about the worst axis, by the positions alone
  double scale_sigma = 0;         // relative
  bool used_directions = false;   // the rotation about the worst axis is theirs
};

/// Similarity from a map to measured positions that hold outliers: least median of squares over samples of
/// three (Rousseeuw 1984; Umeyama 1991), refined on the inliers of a noise level that the median gives. No
/// threshold in metres is needed; up to half of the positions may be wrong. `directions`: used where the
/// positions leave the rotation open and where they agree with the positions. Throws nothing.
PositionAlignment align_positions(const std::vector<PositionPair>& pairs,
                                  const std::vector<DirectionPair>& directions,
                                  const PositionAlignmentOptions& options);

}  // namespace mono_pose_tracker
