// The part of the Mapper that removes unconfirmed landmarks and redundant keyframes.

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "keyframe_landmarks.h"
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

void Mapper::cull_young_landmarks(KeyframeId newest) {
  for (const LandmarkId l : map().landmarks_created_by(newest - limits_.keyframes_to_confirm)) {
    if (map().landmark(l)->observations.size() == 2) present().map.remove_landmark(l);
  }
}

// Removes keyframes whose landmarks enough others observe.
void Mapper::cull_keyframes(KeyframeId newest) {
  for (const KeyframeId id : neighbors(map(), newest, options_.mapping.window_keyframes)) {
    if (map().keyframes().size() <= limits_.fewest_keyframes || id == map().keyframes().begin()->first)
      continue;
    const std::vector<LandmarkId> seen = landmarks_of(*map().keyframe(id));
    const auto redundant = std::count_if(seen.begin(), seen.end(), [&](LandmarkId l) {
      return map().landmark(l)->observations.size() > static_cast<std::size_t>(limits_.redundant_observers);
    });
    if (redundant < options_.mapping.redundant_overlap * seen.size()) continue;
    if (!neighbors(map(), id, 1).empty()) atlas_.remove_keyframe(id, options_);
  }
}

// Above the limit, removes the most redundant keyframes, but never the first two, which define the map's
// frame, nor those near the camera.
void Mapper::cap_keyframes(KeyframeId newest) {
  const auto most = static_cast<std::size_t>(options_.mapping.max_keyframes);
  if (most == 0) return;
  // Frames of the last minutes are stored relative to these.
  present().map.forget_removed_keyframes(limits_.removed_keyframes);
  if (map().keyframes().size() <= most) return;
  std::set<KeyframeId> spared = {newest};
  // At most half of the cap: a map smaller than two windows must lose some of its window.
  const int window = std::min(options_.mapping.window_keyframes, static_cast<int>(most / 2));
  for (const KeyframeId id : neighbors(map(), newest, window)) spared.insert(id);
  auto first = map().keyframes().begin();
  for (int i = 0; i < 2; ++i) spared.insert((first++)->first);
  std::map<KeyframeId, double> shares;
  for (const auto& [id, keyframe] : map().keyframes()) {
    if (!spared.count(id)) shares[id] = redundant_share(limits_, map(), keyframe);
  }
  const std::size_t kept = most - most / limits_.room_made_at_once;
  while (map().keyframes().size() > kept && !shares.empty()) {
    const KeyframeId least_useful = most_redundant(shares);
    const auto affected = map().covisible(least_useful);
    atlas_.remove_keyframe(least_useful, options_);
    shares.erase(least_useful);
    for (const auto& entry : affected) {
      const auto share = shares.find(entry.first);
      if (share != shares.end())
        share->second = redundant_share(limits_, map(), *map().keyframe(entry.first));
    }
  }
}

}  // namespace mono_pose_tracker
