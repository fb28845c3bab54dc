#include "mono_pose_tracker/mapping/matches_in_time.h"

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/parallel.h"

namespace mono_pose_tracker {

MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  MatchesInTime matches(in_time.empty() ? 0 : in_time.size() - 1);
  parallel_for(static_cast<int>(matches.size()), threads, [&](int i) {
    matches[i] = match_descriptors(in_time[i]->image->set.descriptors, in_time[i + 1]->image->set.descriptors,
                                   matching);
  });
  return matches;
}

}  // namespace mono_pose_tracker
