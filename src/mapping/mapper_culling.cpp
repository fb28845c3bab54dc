// The part of the Mapper that removes outliers and redundant keyframes.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include "common/rotation.h"
#include "keyframe_landmarks.h"
#include "landmark_parallax.h"
#include "mapping/mapper.h"

namespace mono_pose_tracker {

namespace {

// Share of the keyframe's landmarks for which it is redundant: at least redundant_observers others observe
// them on the same scale or a finer one. 1 when it observes none.
double redundant_share(const MapperLimits& limits, const Map& map, const Keyframe& keyframe) {
  int all = 0, redundant = 0;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
    if (!landmark) continue;
    ++all;
    const float coarsest = limits.same_scale * keyframe.image->set.features[f].scale;
    int others = 0;
    for (const Observation& o : landmark->observations) {
      others += o.keyframe != keyframe.id &&
                map.keyframe(o.keyframe)->image->set.features[o.feature].scale <= coarsest;
    }
    redundant += others >= limits.redundant_observers;
  }
  return all == 0 ? 1 : static_cast<double>(redundant) / all;
}

// The earliest of equals.
KeyframeId most_redundant(const std::map<KeyframeId, double>& shares) {
  return std::max_element(shares.begin(), shares.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

// Removes observations with large reprojection errors, then landmarks with a single observation or too small
// a parallax.
void Mapper::cull_observations(const std::vector<LandmarkId>& landmarks) {
  for (const LandmarkId l : landmarks) {
    const Landmark* landmark = map_.landmark(l);
    if (!landmark) continue;
    for (const Observation& o : std::vector<Observation>(landmark->observations)) {
      if (error_px(*map_.keyframe(o.keyframe), o.feature, landmark->x_in_map) >
          options_.mapping.max_reprojection_px) {
        map_.remove_observation(l, o.keyframe);
      }
    }
    // Half the parallax that creation needs: bundle adjustment may move a point a little farther away.
    if (landmark->observations.size() < 2 ||
        !has_parallax(map_, *landmark, 0.5 * options_.mapping.min_parallax_deg * kDegree)) {
      map_.remove_landmark(l);
    }
  }
}

void Mapper::cull_young_landmarks(KeyframeId newest) {
  for (const LandmarkId l : map_.landmarks_created_by(newest - limits_.keyframes_to_confirm)) {
    if (map_.landmark(l)->observations.size() == 2) map_.remove_landmark(l);
  }
}

// Removes keyframes whose landmarks enough others observe.
void Mapper::cull_keyframes(KeyframeId newest) {
  for (const KeyframeId id : neighbors(newest, options_.mapping.window_keyframes)) {
    if (map_.keyframes().size() <= limits_.fewest_keyframes || id == map_.keyframes().begin()->first)
      continue;
    const std::vector<LandmarkId> seen = landmarks_of(*map_.keyframe(id));
    const auto redundant = std::count_if(seen.begin(), seen.end(), [&](LandmarkId l) {
      return map_.landmark(l)->observations.size() > static_cast<std::size_t>(limits_.redundant_observers);
    });
    if (redundant < options_.mapping.redundant_overlap * seen.size()) continue;
    if (!neighbors(id, 1).empty()) remove_keyframe(id);
  }
}

// The pose of a removed keyframe is stored relative to the keyframe with most common landmarks, else to the
// one before it.
void Mapper::remove_keyframe(KeyframeId id) {
  const std::vector<LandmarkId> seen = landmarks_of(*map_.keyframe(id));
  const std::vector<KeyframeId> nearest = neighbors(id, 1);
  map_.remove_keyframe(id, nearest.empty() ? std::prev(map_.keyframes().find(id))->first : nearest[0]);
  map_state_.excluded.erase(id);
  map_state_.unmasked.erase(id);
  covariances_.erase(id);
  cull_observations(seen);
}

void Mapper::remove_keyframes(const std::set<KeyframeId>& ids) {
  std::set<KeyframeId> spared;  // two define the frame of the map
  for (auto keyframe = map_.keyframes().begin(); keyframe != map_.keyframes().end() && spared.size() < 2;
       ++keyframe)
    spared.insert(keyframe->first);
  for (const KeyframeId id : ids) {
    if (map_.keyframe(id) && !spared.count(id)) remove_keyframe(id);
  }
  // The baseline of a misregistered view gives no unit.
  if (unit_.baseline && !map_.keyframe(unit_.baseline->second) && ids.count(unit_.baseline->second) > 0)
    unit_.baseline.reset();
  for (const KeyframeId id : ids) {
    if (!map_.keyframe(id)) unit_.markers.erase(id);
  }
  publish();
}

// Above the limit, removes the most redundant keyframes, but never the first two, which define the map's
// frame, nor those near the camera.
void Mapper::cap_keyframes(KeyframeId newest) {
  const auto most = static_cast<std::size_t>(options_.mapping.max_keyframes);
  if (most == 0) return;
  // Frames of the last minutes are stored relative to these.
  map_.forget_removed_keyframes(limits_.removed_keyframes);
  if (map_.keyframes().size() <= most) return;
  std::set<KeyframeId> spared = {newest};
  // At most half of the cap: a map smaller than two windows must lose some of its window.
  const int window = std::min(options_.mapping.window_keyframes, static_cast<int>(most / 2));
  for (const KeyframeId id : neighbors(newest, window)) spared.insert(id);
  auto first = map_.keyframes().begin();
  for (int i = 0; i < 2; ++i) spared.insert((first++)->first);
  std::map<KeyframeId, double> shares;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (!spared.count(id)) shares[id] = redundant_share(limits_, map_, keyframe);
  }
  const std::size_t kept = most - most / limits_.room_made_at_once;
  while (map_.keyframes().size() > kept && !shares.empty()) {
    const KeyframeId least_useful = most_redundant(shares);
    const auto affected = map_.covisible(least_useful);
    remove_keyframe(least_useful);
    shares.erase(least_useful);
    for (const auto& entry : affected) {
      const auto share = shares.find(entry.first);
      if (share != shares.end()) share->second = redundant_share(limits_, map_, *map_.keyframe(entry.first));
    }
  }
}

}  // namespace mono_pose_tracker
