#include "mono_pose_tracker/mapping/matches_in_time.h"

#include <algorithm>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/parallel.h"

namespace mono_pose_tracker {

MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads, int apart) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  MatchesInTime matches(std::max(0, static_cast<int>(in_time.size()) - apart));
  parallel_for(static_cast<int>(matches.size()), threads, [&](int i) {
    matches[i] = match_descriptors(in_time[i]->image->set.descriptors,
                                   in_time[i + apart]->image->set.descriptors, matching);
  });
  return matches;
}

}  // namespace mono_pose_tracker
