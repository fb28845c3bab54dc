#include "alternative_map.h"

#include <unordered_map>
#include <vector>

#include "common/statistics.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

// Of an observation that the map may have lost.
double capped_error2(const Map& map, const Observation& observation) {
  constexpr double cap = kAlternativeMaps.outlier_sigmas * kAlternativeMaps.outlier_sigmas;
  const Keyframe* keyframe = map.keyframe(observation.keyframe);
  const Landmark* landmark =
      keyframe ? map.landmark(keyframe->landmark_of_feature[observation.feature]) : nullptr;
  if (!landmark) return cap;
  const double error = error_px(*keyframe, observation.feature, landmark->x_in_map);
  return std::min(error * error, cap);
}

}  // namespace

double p_value_of(const Map& alternative, const Map& map, double min_extra_cost) {
  std::vector<double> costs, others;
  for (const LandmarkId id : map.landmark_ids()) {
    costs.push_back(0);
    others.push_back(0);
    for (const Observation& o : map.landmark(id)->observations) {
      costs.back() += capped_error2(alternative, o);
      others.back() += capped_error2(map, o);
    }
  }
  return p_value_of_extra_cost(costs, others, min_extra_cost);
}

std::optional<Map> sample_of(const BundleOptions& bundle, const Map& map) {
  std::unordered_map<KeyframeId, int> left;  // observations
  std::size_t all = 0;
  for (const auto& entry : map.landmarks()) {
    for (const Observation& o : entry.second.observations) ++left[o.keyframe], ++all;
  }
  const std::size_t step = all / std::max(kAlternativeMaps.enough_of_map,
                                          kAlternativeMaps.enough_of_keyframe * map.keyframes().size());
  if (step < 2) return std::nullopt;
  Map sample = map;
  std::size_t i = 0;
  for (const LandmarkId l : map.landmark_ids()) {
    const std::vector<Observation>& seen = map.landmark(l)->observations;
    const bool is_needed = std::any_of(seen.begin(), seen.end(), [&](const Observation& o) {
      return left[o.keyframe] <= kAlternativeMaps.enough_of_keyframe;
    });
    if (i++ % step == 0 || is_needed) continue;
    for (const Observation& o : seen) --left[o.keyframe];
    sample.remove_landmark(l);
  }
  BundleOptions settled = bundle;
  settled.max_iterations = kAlternativeMaps.max_iterations;
  adjust_map(settled, &sample);
  return sample;
}

}  // namespace mono_pose_tracker
