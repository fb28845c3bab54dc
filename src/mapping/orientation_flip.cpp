#include "orientation_flip.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/statistics.h"

namespace mono_pose_tracker {

namespace {

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

std::vector<SimilarityMatch> with_depth_noise(std::vector<SimilarityMatch> observations, double share,
                                              double bend) {
  for (SimilarityMatch& m : observations) {
    m.in_a.depth_sigma = std::hypot(bend, share * m.in_a.depth_sigma);
    m.in_b.depth_sigma = std::hypot(bend, share * m.in_b.depth_sigma);
  }
  return observations;
}

bool is_flipped(const SimilarityReport& one, const Sim3& other, double min_flip) {
  return one.b_from_a.rotation.angularDistance(other.rotation) > min_flip;
}

}  // namespace

std::optional<Sim3> resolve_flip(const std::vector<SimilarityMatch>& observations,
                                 const SimilarityOptions& options, const Sim3& found, int min_inliers,
                                 const OrientationFlipOptions& flip) {
  Sim3 of_points;
  if (!fit_points(observations, refine_similarity_by_depths(observations, options, found).inliers,
                  &of_points))
    return found;
  const std::vector<SimilarityMatch> known =
      with_depth_noise(observations, share_of_depth_noise(observations, of_points), flip.bend);
  const SimilarityReport as_found = refine_similarity_by_depths(known, options, found),
                         from_points = refine_similarity_by_depths(known, options, of_points);
  const SimilarityReport& best = from_points.score < as_found.score ? from_points : as_found;
  if (best.num_inliers < min_inliers) return found;
  if (!best.success) return std::nullopt;
  return is_flipped(best, found, flip.min_flip) ? best.b_from_a : found;
}

}  // namespace mono_pose_tracker
