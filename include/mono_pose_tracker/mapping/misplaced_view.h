#pragma once

#include <cstdint>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Two keyframes that look alike, in parts of the map that hang together by little, and how much of what one
/// sees of the map the other shows elsewhere. A part of a recording that was put in a wrong place agrees with
/// itself, and hangs on the rest by a few wrong points; that the rest shows the very same in another place
/// gives it away.
struct MisplacedView {
  std::int64_t frame_index = -1;        // nothing where no two look alike, and landmarks is 0
  std::int64_t other_frame_index = -1;  // which looks like it
  int landmarks = 0;                    // that the other sees
  int elsewhere = 0;                    // of them: in view by the map, and found again in another place

  double share() const { return landmarks > 0 ? static_cast<double>(elsewhere) / landmarks : 0; }

  /// Wrong matches are one in thirty of the landmarks at most in right maps. A head whose second half was put
  /// 8 degrees beside its place has one in five. A part so far beside that the landmarks are out of view is
  /// not seen.
  static constexpr double kOfARightMap = 1.0 / 30, kOfAWrongMap = 1.0 / 10;
  /// Standard deviations of a count, which chance exceeds in one pair of 4,000.
  static constexpr double kDeviations = 3.5;
  bool is_significant() const;
};

/// The worst, of each keyframe and the three of other parts that look most like it, by the place index. A
/// part is what a chain of keyframes holds together that share a third of their landmarks: within one, what
/// looks alike is another thing, as identical doors are. Nor is one of this run asked with one of a map that
/// was loaded (things may have been moved since). The same for any number of threads.
MisplacedView most_misplaced_view(const Map& map, const MatchOptions& matching, int threads);

}  // namespace mono_pose_tracker
