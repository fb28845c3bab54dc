#include "orientation_flip.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/angles.h"
#include "common/median.h"

namespace mono_pose_tracker {

namespace {

// Share of a distance by which a map may be bent between two of its views, however well each point is known.
constexpr double kBend = 0.02;

// Aligns the points themselves, without the rays: the half of the inliers with the lowest depth uncertainty.
bool fit_points(const std::vector<SimilarityMatch>& observations, const std::vector<char>& inliers,
                Sim3* b_from_a) {
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (inliers[i]) sigmas.push_back(observations[i].depth_sigma());
  }
  if (sigmas.empty()) return false;
  const double most = median(std::move(sigmas));
  std::vector<Eigen::Vector3d> in_a, in_b;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!inliers[i] || observations[i].depth_sigma() > most) continue;
    in_a.push_back(observations[i].in_a.x);
    in_b.push_back(observations[i].in_b.x);
  }
  return align_sim3(in_a, in_b, b_from_a);
}

// Ratio of the actual to the expected depth errors: a landmark with many sharp observations is far better
// known than from two.
double share_of_depth_noise(const std::vector<SimilarityMatch>& observations, const Sim3& b_from_a) {
  std::vector<double> off;
  for (const SimilarityMatch& m : observations) {
    const double there = (b_from_a * m.in_a.x - m.in_b.center).norm(),
                 here = (m.in_b.x - m.in_b.center).norm();
    off.push_back(std::abs(std::log(there / here)) / m.depth_sigma());
  }
  return std::min(1.0, 1.48 * median(std::move(off)));
}

std::vector<SimilarityMatch> with_depth_noise(std::vector<SimilarityMatch> observations, double share) {
  for (SimilarityMatch& m : observations) {
    m.in_a.depth_sigma = std::hypot(kBend, share * m.in_a.depth_sigma);
    m.in_b.depth_sigma = std::hypot(kBend, share * m.in_b.depth_sigma);
  }
  return observations;
}

using Refine = SimilarityReport (*)(const std::vector<SimilarityMatch>&, const SimilarityOptions&,
                                    const Sim3&);

// Refines from two initial values, the similarity and the alignment of its points, and returns the one with
// the lower cost.
SimilarityReport lower_cost_of(const std::vector<SimilarityMatch>& observations,
                               const SimilarityOptions& options, const SimilarityReport& report,
                               Refine refine) {
  Sim3 start;
  if (!fit_points(observations, report.inliers, &start)) return report;
  const std::vector<SimilarityMatch> known =
      with_depth_noise(observations, share_of_depth_noise(observations, start));
  SimilarityReport as_it_was = refine(known, options, report.b_from_a),
                   from_points = refine(known, options, start);
  return from_points.score < as_it_was.score ? from_points : as_it_was;
}

}  // namespace

SimilarityReport similarity_from_points(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& by_angles) {
  return lower_cost_of(observations, options, by_angles, refine_similarity);
}

bool is_flipped(const SimilarityReport& one, const SimilarityReport& other) {
  constexpr double kMinFlip = 5 * kDegree;
  return one.b_from_a.rotation.angularDistance(other.b_from_a.rotation) > kMinFlip;
}

SimilarityReport resolve_flip_by_depths(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& found) {
  if (!found.success) return found;
  const SimilarityReport by_depths = lower_cost_of(observations, options, found, refine_similarity_by_depths);
  return is_flipped(by_depths, found) ? by_depths : found;
}

}  // namespace mono_pose_tracker
