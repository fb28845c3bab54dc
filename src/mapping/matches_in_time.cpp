#include "mapping/matches_in_time.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "common/parallel.h"
#include "keyframe_landmarks.h"

namespace mono_pose_tracker {

std::vector<SeenImage> images_in_time(const Map& map) {
  std::vector<SeenImage> images;
  images.reserve(map.keyframes().size());
  for (const Keyframe* keyframe : keyframes_in_time(map)) {
    images.push_back({keyframe->frame_index, keyframe->image});
  }
  return images;
}

namespace {

std::vector<Match> match_pair(const SeenImage& a, const SeenImage& b, const MatchOptions& matching) {
  return match_descriptors(a.image->set.descriptors, b.image->set.descriptors, matching);
}

}  // namespace

MatchesInTime match_in_time(const std::vector<SeenImage>& images, const MatchOptions& matching, int threads,
                            int apart) {
  MatchesInTime matches(std::max(0, static_cast<int>(images.size()) - apart));
  parallel_for(static_cast<int>(matches.size()), threads,
               [&](int i) { matches[i] = match_pair(images[i], images[i + apart], matching); });
  return matches;
}

MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads) {
  return match_in_time(images_in_time(map), matching, threads);
}

// An image never changes, so that the same two have the same matches.
const MatchesInTime& KnownMatches::of(const Map& map, const MatchOptions& matching, int threads) {
  std::map<std::pair<ImageFeaturesPtr, ImageFeaturesPtr>, std::vector<Match>> known;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    known[{images_[i].image, images_[i + 1].image}] = std::move(matches_[i]);
  }
  images_ = images_in_time(map);
  matches_.assign(images_.empty() ? 0 : images_.size() - 1, {});
  std::vector<int> unknown;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    if (auto node = known.extract({images_[i].image, images_[i + 1].image})) {
      matches_[i] = std::move(node.mapped());
    } else {
      unknown.push_back(static_cast<int>(i));
    }
  }
  parallel_for(static_cast<int>(unknown.size()), threads, [&](int u) {
    const int i = unknown[u];
    matches_[i] = match_pair(images_[i], images_[i + 1], matching);
  });
  return matches_;
}

}  // namespace mono_pose_tracker
