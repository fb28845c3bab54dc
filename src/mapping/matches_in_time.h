#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// An image of a recording.
struct SeenImage {
  std::int64_t frame_index = 0;
  ImageFeaturesPtr image;
};

/// Of a map's keyframes.
std::vector<SeenImage> images_in_time(const Map& map);

/// Of images in the order of time: the i-th with the one after it, or so many after it. What asks a finished
/// map for contradictions matches its keyframes anew by descriptors alone, all by the same matches.
using MatchesInTime = std::vector<std::vector<Match>>;

/// On so many threads; the result is the same for any number.
MatchesInTime match_in_time(const std::vector<SeenImage>& images, const MatchOptions& matching, int threads,
                            int apart = 1);
/// Of a map's keyframes.
MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads);

/// Those of a map that is asked again and again: two images are matched anew only where they did not
/// follow each other before.
class KnownMatches {
 public:
  const MatchesInTime& of(const Map& map, const MatchOptions& matching, int threads);

 private:
  std::vector<SeenImage> images_;
  MatchesInTime matches_;
};

}  // namespace mono_pose_tracker
