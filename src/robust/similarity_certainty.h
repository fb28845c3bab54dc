#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "robust/similarity.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

using SimilarityInformation = Eigen::Matrix<double, kSimilarityParameters, kSimilarityParameters>;

void require_options(const SimilarityOptions& options);

// The matches with finite values, with normalised bearings.
struct UsableMatches {
  explicit UsableMatches(const std::vector<SimilarityMatch>& matches);

  std::size_t all;                  // how many there were
  std::vector<std::size_t> source;  // their indices among these
  std::vector<SimilarityMatch> data;
};

struct Uncertainty {
  double turn = 0;   // rad, about the worst axis
  double scale = 0;  // relative
};

Uncertainty uncertainty_of(const SimilarityInformation& covariance);
Uncertainty greater(const Uncertainty& a, const Uncertainty& b);

// Singular directions get the largest uncertainty that a double can express.
SimilarityInformation inverse_of(const SimilarityInformation& information);

// Uncertainty from the spread of the points: depth noise that widens a line of points must not be mistaken
// for a spread that determines the rotation about the line.
Uncertainty by_points(const std::vector<SimilarityMatch>& inliers, const Sim3& b_from_a);

// Success if rotation and scale are certain enough.
void judge(const Uncertainty& uncertainty, const SimilarityOptions& options, SimilarityReport* report);

}  // namespace mono_pose_tracker
