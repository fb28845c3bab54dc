#include "mapping/map_covariances.h"

#include <algorithm>
#include <utility>

#include "common/rotation.h"
#include "keyframe_landmarks.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

void update_covariances(const MapperOptions& options, const MapperLimits& limits, const Map& map,
                        const std::vector<KeyframeId>& window, KeyframeCovariances* covariances) {
  const auto found =
      keyframe_covariances(window, held_keyframes(options.mapping.window_keyframes),
                           std::min(limits.covariance_landmarks, options.mapping.window_landmarks), map);
  KeyframeCovariances::Changes changes;
  for (const auto& [id, own] : found) {
    Eigen::Matrix<double, 6, 6> covariance = own;
    for (const KeyframeId other : neighbors(map, id, static_cast<int>(map.keyframes().size()))) {
      const auto known = covariances->find(other);
      if (found.count(other) > 0 || known == covariances->end()) continue;
      const Eigen::Matrix<double, 6, 6> carried =
          adjoint(map.keyframe(id)->camera_from_map * map.keyframe(other)->camera_from_map.inverse());
      covariance += carried * known->second * carried.transpose();
      break;
    }
    changes[id] = covariance;
  }
  covariances->change(std::move(changes));
}

KeyframeCovariances find_covariances(const MapperOptions& options, const MapperLimits& limits,
                                     const Map& map) {
  KeyframeCovariances covariances;
  const auto size = static_cast<std::size_t>(options.mapping.window_keyframes);
  std::vector<KeyframeId> window;
  for (const auto& entry : map.keyframes()) {
    window.push_back(entry.first);
    if (window.size() < size && entry.first != map.keyframes().rbegin()->first) continue;
    update_covariances(options, limits, map, window, &covariances);
    window.clear();
  }
  return covariances;
}

void scale_covariances(const std::function<double(KeyframeId)>& scale_of, KeyframeCovariances* covariances) {
  KeyframeCovariances::Changes changes;
  for (const auto& [id, covariance] : *covariances) {
    Eigen::Matrix<double, 6, 6>& scaled = changes[id].emplace(covariance);
    scaled.topRows<3>() *= scale_of(id);
    scaled.leftCols<3>() *= scale_of(id);
  }
  covariances->change(std::move(changes));
}

}  // namespace mono_pose_tracker
