#include "mono_pose_tracker/mapping/seam.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "held_keyframe.h"

namespace mono_pose_tracker {

Seam weakest_seam(const Map& map) {
  std::vector<std::int64_t> frames;  // of the keyframes, in order
  for (const auto& entry : map.keyframes()) frames.push_back(entry.second.frame_index);
  std::sort(frames.begin(), frames.end());
  Seam weakest{0, std::numeric_limits<int>::max()};
  if (frames.size() < 4) return weakest;
  // A landmark holds the seams between its second and its last but one keyframe.
  std::vector<int> change(frames.size() + 1);
  for (const auto& entry : map.landmarks()) {
    std::vector<std::int64_t> seen;
    for (const Observation& o : entry.second.observations) {
      seen.push_back(map.keyframe(o.keyframe)->frame_index);
    }
    if (seen.size() < 4) continue;
    std::sort(seen.begin(), seen.end());
    const auto place = [&](std::int64_t frame) {
      return std::lower_bound(frames.begin(), frames.end(), frame) - frames.begin();
    };
    ++change[place(seen[1]) + 1];
    --change[place(seen[seen.size() - 2]) + 1];
  }
  int held = 0;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    held += change[i];
    // Two keyframes are needed on either side; the loop leaves two after the last seam.
    if (i >= 2 && held < weakest.points) weakest = {frames[i], held};
  }
  return weakest;
}

std::set<KeyframeId> loose_end(const Map& map, std::size_t most) {
  const Seam seam = weakest_seam(map);
  if (seam.holds()) return {};
  std::set<KeyframeId> before, after;
  for (const auto& [id, keyframe] : map.keyframes()) {
    (keyframe.frame_index < seam.frame_index ? before : after).insert(id);
  }
  const std::set<KeyframeId>& loose = after.size() <= before.size() ? after : before;
  // What is left must be more than what is too little.
  if (loose.size() > most || map.keyframes().size() - loose.size() <= most) return {};
  const bool any_held =
      std::any_of(loose.begin(), loose.end(), [&](KeyframeId id) { return is_held(map, *map.keyframe(id)); });
  return any_held ? std::set<KeyframeId>() : loose;
}

}  // namespace mono_pose_tracker
