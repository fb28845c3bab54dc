#include "mono_pose_tracker/mapping/torn_tracks.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/count_deviations.h"
#include "worse_finding.h"

namespace mono_pose_tracker {

namespace {

TornTracks compare(const Keyframe& first, const Keyframe& second, const std::vector<Match>& matches) {
  TornTracks result;
  result.frame_index = second.frame_index;
  for (const Match& m : matches) {
    const LandmarkId in_first = first.landmark_of_feature[m.first];
    const LandmarkId in_second = second.landmark_of_feature[m.second];
    if (in_first == kNoLandmark || in_second == kNoLandmark) continue;
    ++result.matches;
    result.torn += in_first != in_second;
  }
  return result;
}

// By how many deviations of a count with this share more are torn.
double excess(const TornTracks& tracks) {
  return deviations_above(tracks.usual_share, tracks.torn, tracks.matches);
}

bool is_worse(const TornTracks& a, const TornTracks& b) { return is_worse_finding(a, b, excess); }

}  // namespace

bool TornTracks::is_significant() const {
  return torn >= kMinTorn && share() >= kMostOfARightMap && excess(*this) >= kDeviations;
}

TornTracks worst_torn_tracks(const Map& map, const MatchesInTime& matches) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  std::vector<TornTracks> pairs;
  int matched = 0, torn = 0;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    pairs.push_back(compare(*in_time[i], *in_time[i + 1], matches[i]));
    matched += pairs.back().matches;
    torn += pairs.back().torn;
  }
  std::optional<TornTracks> worst;
  for (TornTracks& pair : pairs) {
    pair.usual_share = static_cast<double>(torn) / std::max(1, matched);
    if (!worst || is_worse(pair, *worst)) worst = pair;
  }
  return worst.value_or(TornTracks());
}

}  // namespace mono_pose_tracker
