#include "descriptor_tracks.h"

#include "mapping/matches_in_time.h"

namespace mono_pose_tracker {

FeatureTracks tracks_by_descriptors(const std::vector<const Keyframe*>& in_time, const MatchOptions& matching,
                                    const IsLeftOut& is_left_out, int threads) {
  // Keyframes come every two or three degrees of a turn, and beyond twenty SIFT matches fail.
  constexpr int kReach = 8;
  std::vector<SeenImage> images;
  images.reserve(in_time.size());
  for (const Keyframe* k : in_time) images.push_back({k->frame_index, k->image});
  FeatureTracks tracks(feature_counts(images));
  const int count = static_cast<int>(in_time.size());
  for (int apart = 1; apart <= kReach; ++apart) {
    const MatchesInTime matches = match_in_time(images, matching, threads, apart);
    for (int k = 0; k + apart < count; ++k) {
      const Keyframe &first = *in_time[k], &second = *in_time[k + apart];
      for (const Match& m : matches[k]) {
        if (is_left_out(first.id, m.first) || is_left_out(second.id, m.second)) continue;
        tracks.join(k, m.first, k + apart, m.second);
      }
    }
  }
  return tracks;
}

}  // namespace mono_pose_tracker
