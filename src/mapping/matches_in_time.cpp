#include "mono_pose_tracker/mapping/matches_in_time.h"

#include <algorithm>
#include <utility>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/parallel.h"

namespace mono_pose_tracker {

std::vector<SeenImage> images_in_time(const Map& map) {
  std::vector<SeenImage> images;
  images.reserve(map.keyframes().size());
  for (const Keyframe* keyframe : keyframes_in_time(map)) {
    images.push_back({keyframe->frame_index, keyframe->image});
  }
  return images;
}

MatchesInTime match_in_time(const std::vector<SeenImage>& images, const MatchOptions& matching, int threads,
                            int apart) {
  MatchesInTime matches(std::max(0, static_cast<int>(images.size()) - apart));
  parallel_for(static_cast<int>(matches.size()), threads, [&](int i) {
    matches[i] = match_descriptors(images[i].image->set.descriptors, images[i + apart].image->set.descriptors,
                                   matching);
  });
  return matches;
}

MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads) {
  return match_in_time(images_in_time(map), matching, threads);
}

// An image never changes, so that the same one has the same matches.
const MatchesInTime& KnownMatches::of(const Map& map, const MatchOptions& matching, int threads) {
  std::vector<SeenImage> images = images_in_time(map);
  const auto is_same = [](const SeenImage& a, const SeenImage& b) { return a.image == b.image; };
  if (!std::equal(images.begin(), images.end(), images_.begin(), images_.end(), is_same)) {
    matches_ = match_in_time(images, matching, threads);
    images_ = std::move(images);
  }
  return matches_;
}

}  // namespace mono_pose_tracker
