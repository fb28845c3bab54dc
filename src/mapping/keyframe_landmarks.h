#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// The values in ascending order without duplicates.
template <typename T>
std::vector<T> sorted_unique(std::vector<T> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// Reprojection error of the point at the feature, px, weighted as in bundle adjustment.
inline double error_px(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map) {
  return weighted_error(*keyframe.image, feature, keyframe.camera_from_map * x_in_map);
}

// The landmarks that the keyframe observes, ordered by feature.
inline std::vector<LandmarkId> landmarks_of(const Keyframe& keyframe) {
  std::vector<LandmarkId> ids;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    if (l != kNoLandmark) ids.push_back(l);
  }
  return ids;
}

// The landmarks that any of the keyframes observes, in the order of their ids. Ids of covisible landmarks are
// close together, so they are marked in an array instead of sorted.
inline std::vector<LandmarkId> landmarks_observed_by(const Map& map,
                                                     const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> seen;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId l : map.keyframe(id)->landmark_of_feature) {
      if (l != kNoLandmark) seen.push_back(l);
    }
  }
  if (seen.empty()) return seen;
  const auto [first, last] = std::minmax_element(seen.begin(), seen.end());
  const LandmarkId offset = *first;
  // A map from a file may have ids far apart.
  constexpr std::size_t kSparse = 64;
  if (static_cast<std::size_t>(*last - offset) > kSparse * seen.size()) return sorted_unique(std::move(seen));
  std::vector<char> is_seen(*last - offset + 1, 0);
  for (const LandmarkId l : seen) is_seen[l - offset] = 1;
  seen.clear();
  for (std::size_t i = 0; i < is_seen.size(); ++i) {
    if (is_seen[i]) seen.push_back(offset + static_cast<LandmarkId>(i));
  }
  return seen;
}

// Number of observations of all landmarks.
inline std::size_t count_observations(const Map& map) {
  std::size_t count = 0;
  for (const auto& entry : map.landmarks()) count += entry.second.observations.size();
  return count;
}

// The median of each coordinate of the landmarks, in the frame of a camera or, without one, of the map.
inline Eigen::Vector3d median_position(const Map& map, const Rigid3& camera_from_map = {}) {
  std::array<std::vector<double>, 3> coordinates;
  for (const auto& entry : map.landmarks()) {
    const Eigen::Vector3d x = camera_from_map * entry.second.x_in_map;
    for (int i = 0; i < 3; ++i) coordinates[i].push_back(x[i]);
  }
  return {median(std::move(coordinates[0])), median(std::move(coordinates[1])),
          median(std::move(coordinates[2]))};
}

// At most `count` keyframes that share landmarks with this one, most shared landmarks first.
inline std::vector<KeyframeId> neighbors(const Map& map, KeyframeId id, int count) {
  std::vector<KeyframeId> result;
  for (const auto& [other, shared] : map.covisible(id)) {
    if (static_cast<int>(result.size()) < count) result.push_back(other);
  }
  return result;
}

// Number of fixed keyframes for a window of this size: those that share most landmarks with it. They include
// nearly all covisible keyframes and bound the cost of the adjustment in a large map.
inline int held_keyframes(int window) { return 3 * window; }

// The keyframes in the order of time, those of one image in the order of their ids. The ids of a merged map
// are in another order.
inline std::vector<const Keyframe*> keyframes_in_time(const Map& map) {
  std::vector<const Keyframe*> in_time;
  for (const auto& entry : map.keyframes()) in_time.push_back(&entry.second);
  std::stable_sort(in_time.begin(), in_time.end(),
                   [](const Keyframe* a, const Keyframe* b) { return a->frame_index < b->frame_index; });
  return in_time;
}

// The place of each keyframe in the order of time.
inline std::map<KeyframeId, int> places_in_time(const std::vector<const Keyframe*>& in_time) {
  std::map<KeyframeId, int> places;
  for (std::size_t k = 0; k < in_time.size(); ++k) places[in_time[k]->id] = static_cast<int>(k);
  return places;
}

// Length of the path from the first keyframe to each, map units; at least one entry, which is 0.
inline std::vector<double> path_lengths(const std::vector<const Keyframe*>& in_time) {
  std::vector<double> lengths = {0};
  for (std::size_t k = 1; k < in_time.size(); ++k) {
    lengths.push_back(lengths.back() +
                      (in_time[k]->center_in_map() - in_time[k - 1]->center_in_map()).norm());
  }
  return lengths;
}

}  // namespace mono_pose_tracker
