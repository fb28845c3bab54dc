#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

struct RelativePoseOptions {
  RansacOptions ransac;                 // threshold: Sampson error in radians
  int max_hypotheses = 4;               // distinct local optima kept, the best among them
  double distinct_rotation = 0.0175;    // rad (1 degree): hypotheses nearer in both are one
  double distinct_translation = 0.175;  // rad (10 degrees): of the translations' directions
  // Excludes accidental matches (wrong pairs that happen to lie near their epipolar lines,
  // accidental_matches.h) from the last refinement of the best hypothesis. Meant for wrong matches spread
  // over the whole image, not for those of a repeated texture or of an independently moving object.
  bool without_accidental_matches = true;
  int local_iterations = 4;   // of a model just sampled, at least 0: enough to get near the minimum
  int final_iterations = 25;  // of the hypotheses returned, at least 0: narrow views have long flat valleys
  int inner_samples = 10;     // around the best hypothesis, at least 0; more hardly lower the errors further
  // Share of the best hypothesis' inliers, in [0, 1]: an alternative with fewer explains another part of the
  // scene, if anything.
  double min_alternative_inliers = 0.5;
  // Factors of the rotation for alternatives to the best hypothesis: depth reversal (Necker), and both
  // directions along the bas-relief ambiguity.
  std::array<double, 3> rotation_factors = {-1.0, 0.4, 2.0};
  std::vector<float> quality;  // empty, or one value a pair, smaller is better (PROSAC order)
};

/// One two-view geometry that the matches may have; the translation is of unit length.
struct RelativePoseHypothesis {
  Rigid3 second_from_first;
  double score = 0;  // MSAC: sum of min(e^2, threshold^2), in rad^2, smaller is better
  int num_inliers = 0;
  std::vector<char> inliers;  // one flag a pair: error below the threshold and in front of both cameras
};

struct RelativePoseReport {
  bool success = false;
  std::vector<RelativePoseHypothesis> hypotheses;  // best first; empty when not successful
  int iterations = 0;
  // Degeneracies, measured on the inliers of the best hypothesis.
  int rotation_only_inliers = 0;  // matches that a rotation without translation explains within the threshold
  Eigen::Quaterniond rotation_only = Eigen::Quaterniond::Identity();  // second_from_first of that rotation
  int plane_inliers = 0;  // matches that one plane (a homography) explains within the threshold
};

/// Relative pose of two calibrated views from putative matches of unit bearings: RANSAC with the 5-point
/// solver, cheirality while ranking, and non-linear local optimisation. bearings1[i] matches bearings2[i].
/// Throws std::invalid_argument on options out of range or sizes that differ. Bearings that are not finite
/// are outliers.
RelativePoseReport estimate_relative_pose(const std::vector<Eigen::Vector3d>& bearings1,
                                          const std::vector<Eigen::Vector3d>& bearings2,
                                          const RelativePoseOptions& options);

/// Whether two relative poses, their translations of any length, are one but for noise: nearer than
/// max_rotation, and their translations' directions than max_translation, both in rad.
bool is_same_geometry(const Rigid3& a, const Rigid3& b, double max_rotation, double max_translation);

}  // namespace mono_pose_tracker
