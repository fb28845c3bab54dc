#pragma once

#include <cstddef>
#include <cstdint>
#include <set>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Where a map hangs together least, its keyframes in the order of their frames.
struct Seam {
  std::int64_t frame_index = 0;  // the first keyframe's after it
  int points = 0;                // that hold the two sides together; the largest int where there is no seam

  /// Fewer points hold no seam: each knows the ratio of lengths on the two sides from two depths, each good
  /// to a fifth, so that forty know it to 4.5 per cent.
  static constexpr int kMinPoints = 40;
  bool holds() const { return points >= kMinPoints; }
};

/// Lengths are carried from one side to the other only by landmarks that two keyframes of each side see: what
/// only one of them sees has no depth there. A point that is seen from both sides of several seams counts for
/// each.
Seam weakest_seam(const Map& map);

/// The keyframes on the smaller side of the weakest seam, if it does not hold, they are no more than `most`
/// and the others are more: without them the others hang together better. One of them that is of an earlier
/// run, or of the first two, by which the map has its frame, is left where it is; if more are, they all are.
/// Empty otherwise.
std::set<KeyframeId> loose_end(const Map& map, std::size_t most);

}  // namespace mono_pose_tracker
