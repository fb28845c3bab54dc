// The part of the Mapper that estimates the uncertainty of keyframes.

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "mapping/mapper.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

// The uncertainty within the window plus that of the fixed keyframe that constrains each one most. Errors of
// fixed keyframes are common to all keyframes relative to them, and no number of points averages them out.
void Mapper::update_covariances(const std::vector<KeyframeId>& window) {
  const auto found =
      keyframe_covariances(window, held_keyframes(options_.mapping.window_keyframes),
                           std::min(limits_.covariance_landmarks, options_.mapping.window_landmarks), map_);
  KeyframeCovariances::Changes changes;
  for (const auto& [id, own] : found) {
    Eigen::Matrix<double, 6, 6> covariance = own;
    for (const KeyframeId other : neighbors(id, static_cast<int>(map_.keyframes().size()))) {
      const auto known = covariances_.find(other);
      if (found.count(other) > 0 || known == covariances_.end()) continue;
      const Eigen::Matrix<double, 6, 6> carried =
          adjoint(map_.keyframe(id)->camera_from_map * map_.keyframe(other)->camera_from_map.inverse());
      covariance += carried * known->second * carried.transpose();
      break;
    }
    changes[id] = covariance;
  }
  covariances_.change(std::move(changes));
}

// Covariances of a loaded map, computed window after window in the order of its keyframes.
void Mapper::find_covariances() {
  covariances_ = KeyframeCovariances();
  const auto size = static_cast<std::size_t>(options_.mapping.window_keyframes);
  std::vector<KeyframeId> window;
  for (const auto& entry : map_.keyframes()) {
    window.push_back(entry.first);
    if (window.size() < size && entry.first != map_.keyframes().rbegin()->first) continue;
    update_covariances(window);
    window.clear();
  }
}

// Covariances are in the keyframes' own frames, so that a transformation of the map changes only their
// lengths.
void Mapper::scale_covariances(const std::function<double(KeyframeId)>& scale_of) {
  KeyframeCovariances::Changes changes;
  for (const auto& [id, covariance] : covariances_) {
    Eigen::Matrix<double, 6, 6>& scaled = changes[id].emplace(covariance);
    scaled.topRows<3>() *= scale_of(id);
    scaled.leftCols<3>() *= scale_of(id);
  }
  covariances_.change(std::move(changes));
}

}  // namespace mono_pose_tracker
