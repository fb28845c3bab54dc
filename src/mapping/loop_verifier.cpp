#include "mapping/loop_verifier.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/median.h"
#include "mapping/aliased_places.h"
#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/features/matching.h"
#include "orientation_flip.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

namespace {

constexpr int kMatchedKeyframes = 6;  // of the old place, for descriptor matching
constexpr int kGuidedKeyframes = 12;  // of the old place, for guided matching

// Share of the points' distance: drift that a rotation on the spot, with a path length of zero, may leave.
constexpr double kMaxDriftOfDepth = 0.1;
// A landmark and its feature in a keyframe.
struct LandmarkInKeyframe {
  LandmarkId landmark = kNoLandmark;
  const KeyframeView* keyframe = nullptr;
  int feature = -1;
};

std::vector<KeyframeId> neighbourhood(const TrackingMap& map, KeyframeId id, int most) {
  std::vector<KeyframeId> ids = {id};
  for (const KeyframeId other : map.keyframes.at(id).covisible) {
    if (static_cast<int>(ids.size()) >= most) break;
    if (map.keyframes.count(other) > 0) ids.push_back(other);
  }
  return ids;
}

std::unordered_set<LandmarkId> landmarks_of(const KeyframeView& keyframe) {
  return {keyframe.landmark_of_feature.begin(), keyframe.landmark_of_feature.end()};
}

// Observations of the keyframes' landmarks, each once, from the first keyframe that has it; without those in
// `excluded`.
std::vector<LandmarkInKeyframe> observations(const TrackingMap& map, const std::vector<KeyframeId>& keyframes,
                                             const std::unordered_set<LandmarkId>& excluded) {
  std::vector<LandmarkInKeyframe> result;
  std::unordered_set<LandmarkId> known = excluded;
  for (const KeyframeId id : keyframes) {
    const KeyframeView& keyframe = map.keyframes.at(id);
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark || map.landmarks.count(l) == 0 || !known.insert(l).second) continue;
      result.push_back({l, &keyframe, static_cast<int>(f)});
    }
  }
  return result;
}

cv::Mat descriptors_of(const std::vector<LandmarkInKeyframe>& observations) {
  return stacked_descriptors(observations, [](const LandmarkInKeyframe& observation) {
    return observation.keyframe->image->set.descriptor(observation.feature);
  });
}

ObservedPoint observed_point(const TrackingMap& map, const LandmarkInKeyframe& observation) {
  return observed_point(*observation.keyframe, observation.feature, map.landmarks.at(observation.landmark));
}

// Paired observations of the new side (a) and the old side (b).
struct Pairs {
  std::vector<SimilarityMatch> points;
  std::vector<std::pair<LandmarkId, LandmarkId>> landmarks;  // new, old

  void add(const TrackingMap& map, const LandmarkInKeyframe& in_new, const LandmarkInKeyframe& in_old) {
    points.push_back({observed_point(map, in_new), observed_point(map, in_old)});
    landmarks.emplace_back(in_new.landmark, in_old.landmark);
  }
};

// Resolves an orientation flip of the similarity by the points.
SimilarityReport resolve_flip(std::vector<SimilarityMatch> observations, const SimilarityOptions& options,
                              const SimilarityReport& by_angles) {
  constexpr double kDepthSigma = 0.2;  // prior of every point
  for (SimilarityMatch& m : observations) m.in_a.depth_sigma = m.in_b.depth_sigma = kDepthSigma;
  SimilarityReport by_points = similarity_from_points(observations, options, by_angles);
  return by_points.success && is_flipped(by_points, by_angles) ? by_points : by_angles;
}

// Fits a similarity with at least `min_inliers` inliers, and drops the outliers.
bool fit(const MapperOptions& options, int seed, Pairs* pairs, Sim3* old_from_new) {
  if (static_cast<int>(pairs->points.size()) < options.min_inliers) return false;
  SimilarityOptions similarity;
  similarity.ransac = options.ransac;
  similarity.ransac.seed += static_cast<std::uint64_t>(seed);
  SimilarityReport report = estimate_similarity(pairs->points, similarity);
  if (report.success) report = resolve_flip(pairs->points, similarity, report);
  if (!report.success || report.num_inliers < options.min_inliers) return false;
  Pairs inliers;
  for (std::size_t i = 0; i < pairs->points.size(); ++i) {
    if (!report.inliers[i]) continue;
    inliers.points.push_back(pairs->points[i]);
    inliers.landmarks.push_back(pairs->landmarks[i]);
  }
  *pairs = std::move(inliers);
  *old_from_new = report.b_from_a;
  return true;
}

// Candidates for the old landmarks, in the frame of the new side.
std::vector<LandmarkCandidate> candidates_in_new(const TrackingMap& map,
                                                 const std::vector<LandmarkInKeyframe>& old,
                                                 const Sim3& new_from_old) {
  std::vector<LandmarkCandidate> candidates;
  for (const LandmarkInKeyframe& observation : old) {
    LandmarkCandidate c = make_candidate(observation.landmark, map.landmarks.at(observation.landmark),
                                         *observation.keyframe->image, observation.feature,
                                         observation.keyframe->camera_from_map.inverse().translation);
    c.x_in_map = new_from_old * c.x_in_map;
    c.seen_from = new_from_old.rotation * c.seen_from;
    c.scale_times_distance *= new_from_old.scale;
    candidates.push_back(c);
  }
  return candidates;
}

// Searches for the landmarks that the similarity brings into view.
struct GuidedSearch {
  Pairs pairs;               // both sides have a landmark
  std::vector<int> inliers;  // features of the new image with an old landmark
  ExpectedFinds in_map;
};

GuidedSearch search(const MapperOptions& options, const CameraModel& camera, const TrackingMap& map,
                    const KeyframeView& keyframe, const std::vector<LandmarkInKeyframe>& old,
                    const Sim3& old_from_new) {
  ProjectionMatchOptions guided;
  // The similarity is accurate to an observation's error where its inliers are, and to a few times that
  // elsewhere.
  guided.radius_px = 3 * options.mapping.transferred_px(camera);
  guided.max_distance2 = stored_distance2(options.mapping.max_descriptor_distance);
  const std::vector<LandmarkCandidate> candidates = candidates_in_new(map, old, old_from_new.inverse());
  GuidedSearch result;
  result.in_map = expected_finds(candidates, camera, keyframe.camera_from_map, guided);
  for (const LandmarkMatch& m :
       match_by_projection(candidates, *keyframe.image, camera, keyframe.camera_from_map, guided)) {
    const Eigen::Vector3d x_in_camera = keyframe.camera_from_map * candidates[m.candidate].x_in_map;
    if (weighted_error(*keyframe.image, m.feature, x_in_camera) < options.mapping.max_reprojection_px) {
      result.inliers.push_back(m.feature);
    }
    const LandmarkId own = keyframe.landmark_of_feature[m.feature];
    if (own == kNoLandmark || map.landmarks.count(own) == 0) continue;
    result.pairs.add(map, {own, &keyframe, m.feature}, old[m.candidate]);
  }
  return result;
}

// Drift as a share of the path between the two keyframes; nothing when it exceeds the limit.
std::optional<double> drift_of(const TrackingMap& map, const KeyframeView& keyframe, KeyframeId place,
                               const Pairs& pairs, const Sim3& old_from_new) {
  if (old_from_new.rotation.angularDistance(Eigen::Quaterniond::Identity()) > kMaxRotationDrift)
    return std::nullopt;
  const Eigen::Vector3d center = keyframe.camera_from_map.inverse().translation;
  std::vector<double> distances;
  for (const SimilarityMatch& match : pairs.points) distances.push_back((match.in_a.x - center).norm());
  const double way = path_length_between(map, map.keyframes.at(place), keyframe);
  const double moved = (old_from_new * center - center).norm();
  if (moved > kMaxDrift * way + kMaxDriftOfDepth * median(std::move(distances))) return std::nullopt;
  return way > 0 ? moved / way : 0;
}

Pairs match_landmarks(const MapperOptions& options, const TrackingMap& map,
                      const std::vector<LandmarkInKeyframe>& in_new,
                      const std::vector<LandmarkInKeyframe>& in_old) {
  Pairs pairs;
  for (const Match& m : match_descriptors(descriptors_of(in_new), descriptors_of(in_old), options.matching)) {
    pairs.add(map, in_new[m.first], in_old[m.second]);
  }
  return pairs;
}

}  // namespace

std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const TrackingMap& map,
                                          KeyframeId keyframe_id, KeyframeId place) {
  const KeyframeView& keyframe = map.keyframes.at(keyframe_id);
  const CameraModel& camera = keyframe.image->camera;
  // Landmarks that both sides observe already contain no drift.
  const std::unordered_set<LandmarkId> own = landmarks_of(keyframe);
  const std::vector<LandmarkInKeyframe> in_new = observations(map, {keyframe_id}, {});
  Pairs pairs = match_landmarks(options, map, in_new,
                                observations(map, neighbourhood(map, place, kMatchedKeyframes), own));
  LoopConstraint loop;
  if (!fit(options, keyframe_id, &pairs, &loop.old_from_new)) return std::nullopt;
  const std::vector<LandmarkInKeyframe> old =
      observations(map, neighbourhood(map, place, kGuidedKeyframes), own);
  pairs = search(options, camera, map, keyframe, old, loop.old_from_new).pairs;
  if (!fit(options, keyframe_id, &pairs, &loop.old_from_new)) return std::nullopt;
  const std::optional<double> drift = drift_of(map, keyframe, place, pairs, loop.old_from_new);
  if (!drift) return std::nullopt;
  loop.drift = *drift;
  const GuidedSearch found = search(options, camera, map, keyframe, old, loop.old_from_new);
  loop.support = pose_support(*keyframe.image, camera.width(), camera.height(), found.inliers, found.in_map);
  if (!is_supported(loop.support, options.min_inliers)) return std::nullopt;
  loop.from = place;
  loop.to = keyframe_id;
  loop.from_from_to = Sim3(map.keyframes.at(place).camera_from_map) * loop.old_from_new *
                      Sim3(keyframe.camera_from_map.inverse());
  loop.matches = std::move(pairs.landmarks);
  return loop;
}

double loop_disagreement_px(const TrackingMap& map, const LoopConstraint& loop, const LoopConstraint& other) {
  const auto old_place = map.keyframes.find(other.from);
  if (old_place == map.keyframes.end()) return std::numeric_limits<double>::infinity();
  const Rigid3& camera_from_map = old_place->second.camera_from_map;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> x_in_camera;
  for (const auto& [in_new, in_old] : other.matches) {
    const auto x_in_new = map.landmarks.find(in_new), x_in_old = map.landmarks.find(in_old);
    if (x_in_new == map.landmarks.end() || x_in_old == map.landmarks.end()) continue;
    x_in_camera.emplace_back(camera_from_map * x_in_old->second,
                             camera_from_map * (loop.old_from_new * x_in_new->second));
  }
  return disagreement_px(old_place->second.image->camera, x_in_camera);
}

}  // namespace mono_pose_tracker
