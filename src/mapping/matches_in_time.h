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

/// The images of the map's keyframes, in the order of time.
std::vector<SeenImage> images_in_time(const Map& map);

/// Matches of each image with the next one (or the one `apart` later), images in the order of time. The
/// consistency checks of a finished map match its keyframes again by descriptors alone, and all share these
/// matches.
using MatchesInTime = std::vector<std::vector<Match>>;

/// The result is the same for any number of threads.
MatchesInTime match_in_time(const std::vector<SeenImage>& images, const MatchOptions& matching, int threads,
                            int apart = 1);
/// The same of a map's keyframes.
MatchesInTime match_in_time(const Map& map, const MatchOptions& matching, int threads);

/// Matches of a map that is checked repeatedly. Two images are matched only if they did not follow each other
/// before.
class KnownMatches {
 public:
  const MatchesInTime& of(const Map& map, const MatchOptions& matching, int threads);

 private:
  std::vector<SeenImage> images_;
  MatchesInTime matches_;
};

}  // namespace mono_pose_tracker
