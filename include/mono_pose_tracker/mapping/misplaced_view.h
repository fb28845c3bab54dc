#pragma once

#include <cstdint>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Two keyframes that do not follow each other but look alike, and how much of what one sees of the map the
/// other shows elsewhere. A part of a recording that was put in a wrong place agrees with itself, and hangs
/// on the rest by a few wrong points; that the rest shows the very same in another place gives it away.
struct MisplacedView {
  std::int64_t frame_index = -1;        // -1: no two look alike
  std::int64_t other_frame_index = -1;  // which looks like it
  int landmarks = 0;                    // that the other sees
  int elsewhere = 0;                    // of them: found again, but not where the map has them

  double share() const { return landmarks > 0 ? static_cast<double>(elsewhere) / landmarks : 0; }

  /// Of the landmarks, however few are found again: wrong matches are one in thirty of them in right maps. A
  /// head whose second half was put 8 degrees beside its place has one in five.
  static constexpr double kOfAWrongMap = 0.1;
  bool is_significant() const { return share() >= kOfAWrongMap; }
};

/// The worst, of each keyframe and the one that looks most like it, by the place index: not the one before or
/// after it, nor what it shares a third of its landmarks with. The same for any number of threads.
MisplacedView most_misplaced_view(const Map& map, const CameraModel& camera, const MatchOptions& matching,
                                  int threads);

}  // namespace mono_pose_tracker
