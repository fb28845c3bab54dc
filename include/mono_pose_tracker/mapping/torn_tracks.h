#pragma once

#include <cstdint>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"

namespace mono_pose_tracker {

/// Two keyframes that follow each other, and how many of the features that they share the map has as two
/// landmarks, each seen by one of them, because no one place agrees with both.
struct TornTracks {
  std::int64_t frame_index = -1;  // of the second; -1: there were none to compare
  int matches = 0;                // of features that see landmarks, by descriptors alone
  int torn = 0;                   // of them: two landmarks
  double usual_share = 0;         // torn of all matches of the map's keyframes that follow each other

  double share() const { return matches > 0 ? static_cast<double>(torn) / matches : 0; }

  /// One match in thirty is torn in a right map: a wrong match, or a point found twice that nothing has
  /// joined yet. Where the poses have gone another way than the scene, by less than would be seen as a
  /// contradiction, it is one in ten, and two degrees off on a head.
  static constexpr double kMostOfARightMap = 1.0 / 11;
  /// A repeated texture tears everywhere. So a pair must exceed the usual share by more than chance makes of
  /// it: by so many standard deviations of a count, which chance does in one pair of 4,000.
  static constexpr double kDeviations = 3.5;
  static constexpr int kMinTorn = 10;
  bool is_significant() const;
};

/// The worst pair of keyframes that follow each other in time: those whose torn tracks exceed the usual share
/// by most deviations. matches: of the map's keyframes.
TornTracks worst_torn_tracks(const Map& map, const MatchesInTime& matches);

}  // namespace mono_pose_tracker
