#include "mono_pose_tracker/mapping/seam.h"

#include <limits>
#include <vector>

#include "held_keyframe.h"
#include "keyframe_landmarks.h"
#include "span_in_time.h"

namespace mono_pose_tracker {

Seam weakest_seam(const Map& map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  Seam weakest{0, std::numeric_limits<int>::max()};
  if (in_time.size() < 4) return weakest;
  std::vector<int> change(in_time.size() + 1);
  for (const SpanInTime& span : spans_in_time(map, in_time)) {
    ++change[span.second + 1];
    --change[span.last_but_one + 1];
  }
  int held = 0;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    held += change[i];
    // Two keyframes are needed on either side; the loop leaves two after the last seam.
    if (i >= 2 && held < weakest.points) weakest = {in_time[i]->frame_index, held};
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
  // One that stays is no side of a seam.
  std::set<KeyframeId> may_go;
  for (const KeyframeId id : loose) {
    if (!is_held(map, *map.keyframe(id))) may_go.insert(id);
  }
  return loose.size() - may_go.size() > 1 ? std::set<KeyframeId>() : may_go;
}

}  // namespace mono_pose_tracker
