#include "mapping/planar_ambiguity.h"

#include <cstddef>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "mapping/depth_reversal.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

struct KeyframePair {
  const Keyframe* first = nullptr;
  const Keyframe* second = nullptr;
};

// The keyframes farthest apart in time with enough common landmarks.
std::optional<KeyframePair> farthest_pair(const Map& map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  const std::map<KeyframeId, int> place = places_in_time(in_time);
  std::optional<KeyframePair> farthest;
  std::size_t apart = 0;
  for (std::size_t i = 0; i < in_time.size(); ++i) {
    for (const auto& [other, shared] : map.covisible(in_time[i]->id)) {
      if (shared < kAlternativeMaps.min_shared) break;  // most first
      const auto j = static_cast<std::size_t>(place.at(other));
      if (j <= i + apart) continue;
      apart = j - i;
      farthest = KeyframePair{in_time[i], in_time[j]};
    }
  }
  return farthest;
}

Rigid3 relative_pose(const KeyframePair& pair) {
  return pair.second->camera_from_map * pair.first->camera_from_map.inverse();
}

std::vector<RelativePoseHypothesis> geometries_of(const KeyframePair& pair, const RansacOptions& ransac) {
  std::unordered_map<LandmarkId, int> in_second;
  for (std::size_t f = 0; f < pair.second->landmark_of_feature.size(); ++f) {
    const LandmarkId l = pair.second->landmark_of_feature[f];
    if (l != kNoLandmark) in_second[l] = static_cast<int>(f);
  }
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  for (std::size_t f = 0; f < pair.first->landmark_of_feature.size(); ++f) {
    const auto seen = in_second.find(pair.first->landmark_of_feature[f]);
    if (seen == in_second.end()) continue;
    bearings1.push_back(pair.first->image->set.bearings[f]);
    bearings2.push_back(pair.second->image->set.bearings[seen->second]);
  }
  RelativePoseOptions options;
  options.ransac = ransac;
  options.without_accidental_matches = false;  // the map has chosen among them
  return estimate_relative_pose(bearings1, bearings2, options).hypotheses;
}

// Grows a map again from two of its keyframes with a given two-view geometry.
class Regrowth {
 public:
  Regrowth(const Map& map, const RansacOptions& ransac)
      : map_(map), options_(AbsolutePoseOptions::in_growing_map(ransac)) {}

  // Nothing when a keyframe cannot be registered in it.
  std::optional<Map> grow(const KeyframePair& pair, const Rigid3& second_from_first) {
    const double baseline = relative_pose(pair).translation.norm();
    place(pair.first->id, pair.first->camera_from_map);
    place(pair.second->id, Rigid3(second_from_first.rotation, baseline * second_from_first.translation) *
                               pair.first->camera_from_map);
    while (poses_.size() < map_.keyframes().size()) {
      if (!register_next()) return std::nullopt;
    }
    Map grown = map_;
    for (const auto& [id, camera_from_map] : poses_) grown.set_pose(id, camera_from_map);
    for (const LandmarkId l : map_.landmark_ids()) {
      const auto point = points_.find(l);
      if (point != points_.end()) {
        grown.set_position(l, point->second);
      } else {
        grown.remove_landmark(l);
      }
    }
    return grown;
  }

 private:
  void place(KeyframeId id, const Rigid3& camera_from_map) {
    poses_[id] = camera_from_map;
    for (const LandmarkId l : landmarks_of(*map_.keyframe(id))) {
      if (points_.count(l) == 0) triangulate(l);
    }
  }

  void triangulate(LandmarkId l) {
    std::vector<Rigid3> cameras;
    std::vector<Eigen::Vector3d> bearings;
    for (const Observation& seen : map_.landmark(l)->observations) {
      const auto pose = poses_.find(seen.keyframe);
      if (pose == poses_.end()) continue;
      cameras.push_back(pose->second);
      bearings.push_back(map_.keyframe(seen.keyframe)->image->set.bearings[seen.feature]);
    }
    Eigen::Vector3d x_in_map;
    if (cameras.size() > 1 && triangulate_multi_view(cameras, bearings, &x_in_map)) points_[l] = x_in_map;
  }

  int points_observed_by(const Keyframe& keyframe) const {
    int count = 0;
    for (const LandmarkId l : landmarks_of(keyframe)) count += static_cast<int>(points_.count(l));
    return count;
  }

  // Registers the keyframe that observes most of the points.
  bool register_next() {
    const Keyframe* next = nullptr;
    int most = kAlternativeMaps.min_inliers - 1;
    for (const auto& [id, keyframe] : map_.keyframes()) {
      if (poses_.count(id) > 0) continue;
      const int seen = points_observed_by(keyframe);
      if (seen <= most) continue;
      most = seen;
      next = &keyframe;
    }
    if (next == nullptr) return false;
    std::vector<Eigen::Vector3d> bearings, points;
    for (std::size_t f = 0; f < next->landmark_of_feature.size(); ++f) {
      const auto point = points_.find(next->landmark_of_feature[f]);
      if (point == points_.end()) continue;
      bearings.push_back(next->image->set.bearings[f]);
      points.push_back(point->second);
    }
    const AbsolutePoseReport report = estimate_absolute_pose(bearings, points, options_);
    if (!report.success || report.num_inliers < kAlternativeMaps.min_inliers) return false;
    place(next->id, report.camera_from_map);
    return true;
  }

  const Map& map_;
  AbsolutePoseOptions options_;
  std::map<KeyframeId, Rigid3> poses_;
  std::unordered_map<LandmarkId, Eigen::Vector3d> points_;
};

// Cost of this number of observations; those that are no longer in the map cost as much as an outlier.
double cost_of(const Map& map, std::size_t observations) {
  constexpr double outlier_sigmas = kAlternativeMaps.outlier_sigmas;
  return cost_of(map) +
         outlier_sigmas * outlier_sigmas * static_cast<double>(observations - count_observations(map));
}

bool is_same_geometry(const Rigid3& a, const Rigid3& b) {
  const RelativePoseOptions distinct;  // as RANSAC tells its hypotheses apart
  return is_same_geometry(a, b, distinct.distinct_rotation, distinct.distinct_translation);
}

// Landmarks left with a single keyframe are dropped.
Map beginning_of(const Map& map, std::size_t keyframes) {
  Map beginning = map;
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  if (in_time.size() <= keyframes) return beginning;
  for (std::size_t i = keyframes; i < in_time.size(); ++i) {
    beginning.remove_keyframe(in_time[i]->id, in_time.front()->id);
  }
  for (const LandmarkId l : beginning.landmark_ids()) {
    if (beginning.landmark(l)->observations.size() < 2) beginning.remove_landmark(l);
  }
  return beginning;
}

struct Alternative {
  Map map;
  double cost = 0;  // relative to the cost of the map itself, equally adjusted
};

// Adjusts the alternative map as far as a comparison needs. Returns false where its cost is far higher than
// `most` or it converges to the map itself.
bool adjust_alternative(BundleOptions bundle, const KeyframePair& pair, std::size_t observations, double most,
                        Map* alternative) {
  bundle.max_iterations = kAlternativeMaps.trial_iterations;
  adjust_map(bundle, alternative);
  if (cost_of(*alternative, observations) > kAlternativeMaps.far_higher_cost * most) return false;
  bundle.max_iterations = kAlternativeMaps.max_iterations;
  adjust_map(bundle, alternative);
  const KeyframePair now = {alternative->keyframe(pair.first->id), alternative->keyframe(pair.second->id)};
  return !is_same_geometry(relative_pose(now), relative_pose(pair));
}

// Landmarks that the other map does not have are dropped.
Map with_landmarks_of(const Map& other, Map map) {
  for (const LandmarkId l : map.landmark_ids()) {
    if (!other.landmark(l)) map.remove_landmark(l);
  }
  return map;
}

// The maps that grow from the other geometries of two distant keyframes, not adjusted.
struct Alternatives {
  KeyframePair pair;
  std::vector<Map> maps;
};

Alternatives grow_alternatives(const RansacOptions& ransac, const Map& map) {
  Alternatives alternatives;
  const std::optional<KeyframePair> pair = farthest_pair(map);
  if (!pair) return alternatives;
  alternatives.pair = *pair;
  for (const RelativePoseHypothesis& geometry : geometries_of(*pair, ransac)) {
    if (is_same_geometry(geometry.second_from_first, relative_pose(*pair))) continue;
    std::optional<Map> grown = Regrowth(map, ransac).grow(*pair, geometry.second_from_first);
    if (grown) alternatives.maps.push_back(std::move(*grown));
  }
  return alternatives;
}

// The adjusted alternative with the lowest cost. compared: the adjusted map, or a sample of it, by whose
// landmarks the costs are compared.
std::optional<Alternative> best_alternative(const BundleOptions& bundle, const Alternatives& alternatives,
                                            const Map& compared) {
  const std::size_t observations = count_observations(compared);
  const double cost = cost_of(compared);
  std::optional<Alternative> best;
  for (const Map& grown : alternatives.maps) {
    Map map = with_landmarks_of(compared, grown);
    if (!adjust_alternative(bundle, alternatives.pair, observations, cost, &map)) continue;
    const double relative = cost_of(map, observations) / cost;
    if (!best || relative < best->cost) best = Alternative{std::move(map), relative};
  }
  return best;
}

// Adjusted as far as an alternative is.
Map adjusted(BundleOptions bundle, Map map) {
  bundle.max_iterations = kAlternativeMaps.trial_iterations + kAlternativeMaps.max_iterations;
  adjust_map(bundle, &map);
  return map;
}

}  // namespace

bool correct_geometry(const BundleOptions& bundle, const RansacOptions& ransac, double min_evidence,
                      Map* map) {
  if (is_narrow(*map)) return false;
  const Alternatives alternatives = grow_alternatives(ransac, *map);
  if (alternatives.maps.empty()) return false;
  if (const std::optional<Map> sample = sample_of(bundle, *map)) {
    const std::optional<Alternative> sampled = best_alternative(bundle, alternatives, *sample);
    if (!sampled || sampled->cost * (1 + min_evidence) >= kAlternativeMaps.sampled_margin) return false;
  }
  std::optional<Alternative> alternative = best_alternative(bundle, alternatives, adjusted(bundle, *map));
  if (!alternative || alternative->cost * (1 + min_evidence) >= 1) return false;
  *map = std::move(alternative->map);
  return true;
}

double planar_p_value(const BundleOptions& bundle, const RansacOptions& ransac, const Map& map) {
  if (is_narrow(map)) return 0;
  const Map beginning = beginning_of(map, kAlternativeMaps.beginning);
  const Alternatives alternatives = grow_alternatives(ransac, beginning);
  if (alternatives.maps.empty()) return 0;
  const std::optional<Map> sample = sample_of(bundle, beginning);
  const Map compared = sample ? *sample : adjusted(bundle, beginning);
  const std::optional<Alternative> alternative = best_alternative(bundle, alternatives, compared);
  return alternative ? p_value_of(alternative->map, compared) : 0;
}

}  // namespace mono_pose_tracker
