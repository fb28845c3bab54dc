#include "facing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

// Of a distance: what a map may be bent by between two of its views, however well each point is known.
constexpr double kBend = 0.02;

// Which fits the points to each other, whatever the sights say: the better known half of those that agree.
bool fit_points(const std::vector<SimilarityMatch>& sights, const std::vector<char>& inliers,
                Sim3* b_from_a) {
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (inliers[i]) sigmas.push_back(sights[i].depth_sigma());
  }
  if (sigmas.empty()) return false;
  const double most = median(std::move(sigmas));
  std::vector<Eigen::Vector3d> in_a, in_b;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (!inliers[i] || sights[i].depth_sigma() > most) continue;
    in_a.push_back(sights[i].in_a.x);
    in_b.push_back(sights[i].in_b.x);
  }
  return align_sim3(in_a, in_b, b_from_a);
}

// How far the depths are off then, over what they were thought to be: a landmark that many images show
// sharply is known far better than by two.
double share_of_depth_noise(const std::vector<SimilarityMatch>& sights, const Sim3& b_from_a) {
  std::vector<double> off;
  for (const SimilarityMatch& m : sights) {
    const double there = (b_from_a * m.in_a.x - m.in_b.center).norm(),
                 here = (m.in_b.x - m.in_b.center).norm();
    off.push_back(std::abs(std::log(there / here)) / m.depth_sigma());
  }
  return std::min(1.0, 1.48 * median(std::move(off)));
}

std::vector<SimilarityMatch> with_depth_noise(std::vector<SimilarityMatch> sights, double share) {
  for (SimilarityMatch& m : sights) {
    m.in_a.depth_sigma = std::hypot(kBend, share * m.in_a.depth_sigma);
    m.in_b.depth_sigma = std::hypot(kBend, share * m.in_b.depth_sigma);
  }
  return sights;
}

}  // namespace

SimilarityReport similarity_from_points(const std::vector<SimilarityMatch>& sights,
                                        const SimilarityOptions& options, const SimilarityReport& by_angles) {
  Sim3 start;
  if (!fit_points(sights, by_angles.inliers, &start)) return by_angles;
  const std::vector<SimilarityMatch> known = with_depth_noise(sights, share_of_depth_noise(sights, start));
  SimilarityReport as_it_was = refine_similarity(known, options, by_angles.b_from_a),
                   from_points = refine_similarity(known, options, start);
  return from_points.score < as_it_was.score ? from_points : as_it_was;
}

SimilarityReport turned_to_depths(const std::vector<SimilarityMatch>& sights,
                                  const SimilarityOptions& options, const SimilarityReport& found) {
  // The two lie 10 degrees apart and more where they are two; less is what a bundle adjustment mends, which
  // goes by angles as `found` does.
  constexpr double kTurnedOver = 5 * kDegree;
  Sim3 start;
  if (!fit_points(sights, found.inliers, &start)) return found;
  const std::vector<SimilarityMatch> known = with_depth_noise(sights, share_of_depth_noise(sights, start));
  const SimilarityReport as_it_was = refine_similarity_by_depths(known, options, found.b_from_a),
                         from_points = refine_similarity_by_depths(known, options, start);
  const SimilarityReport& best = from_points.score < as_it_was.score ? from_points : as_it_was;
  const double turn = best.b_from_a.rotation.angularDistance(found.b_from_a.rotation);
  return turn > kTurnedOver ? best : found;
}

}  // namespace mono_pose_tracker
