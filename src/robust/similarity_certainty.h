#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "robust/similarity.h"
#include "similarity_step.h"

namespace mono_pose_tracker {

using SimilarityInformation = Eigen::Matrix<double, kSimilarityParameters, kSimilarityParameters>;

void require_options(const SimilarityOptions& options);

// The matches that are finite, with unit bearings.
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

// What is singular comes out as large as doubles tell.
SimilarityInformation inverse_of(const SimilarityInformation& information);

// As the points tell it by how far they lie from each other: what one map's noise of depth adds to the width
// of a line must not pass for a width that tells the turn about it.
Uncertainty by_points(const std::vector<SimilarityMatch>& inliers, const Sim3& b_from_a);

// Success is what is certain enough.
void judge(const Uncertainty& uncertainty, const SimilarityOptions& options, SimilarityReport* report);

}  // namespace mono_pose_tracker
