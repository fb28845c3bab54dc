#pragma once

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"

namespace mono_pose_tracker {

/// Of what a map's keyframes show of its landmarks: what stays in its place in the image from one keyframe to
/// another, though by the map it should have left it. A map of a head and of the shoulders below it, which
/// hardly move, holds of the shoulders only what agrees with it, so that no two neighbours contradict it.
struct StillLandmarks {
  int matches = 0;  // of landmarks that should have moved plainly
  int still = 0;    // of them

  double share() const { return matches > 0 ? static_cast<double>(still) / matches : 0; }

  /// A wrong match lies anywhere; in its own place, to within 3 px, one match in 250 of a right map.
  static constexpr double kOfARightMap = 1.0 / 250;
  /// Of maps of a head and the shirt below it, 3.5 and 4.6 degrees off, one in 45 and one in 32.
  static constexpr double kMostOfARightMap = 1.0 / 50;
  /// Chance exceeds the usual share by so many standard deviations of a count in one map of 4,000.
  static constexpr double kDeviations = 3.5;
  static constexpr int kMinStill = 8;
  bool is_significant() const;
};

/// Each keyframe is matched with the first after it in which what it sees should lie plainly elsewhere, of
/// the same camera. What a repeated pattern shows in both places is not counted. matches: of the map's
/// keyframes. The same for any number of threads.
StillLandmarks still_landmarks(const Map& map, const MatchesInTime& matches, const MatchOptions& matching,
                               int threads);

}  // namespace mono_pose_tracker
