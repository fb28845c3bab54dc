#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Two keyframes that follow each other, and how much of what they see of the map speaks against it.
struct ReprojectionInconsistency {
  std::int64_t frame_index = -1;  // of the second; -1: there were none to compare
  int matches = 0;                // of landmarks, by descriptors alone
  int contradicting = 0;          // of them: the landmark lies elsewhere in the second image

  double share() const { return matches > 0 ? static_cast<double>(contradicting) / matches : 0; }

  /// In a right map one match in twenty lies elsewhere at most, a wrong match or something that moves by
  /// itself. One in seven is a part of the scene that has gone another way than the map says, even if each of
  /// its sides looks well by itself; one in ten is, where so many are not in a right map by chance.
  static constexpr double kOfARightMap = 1.0 / 20, kMostOfARightMap = 1.0 / 10, kOfAWrongMap = 1.0 / 7;
  /// Normal standard deviations of a count; the exact tail of the fewest that count (8 of 56) is 1 in 154.
  static constexpr double kDeviations = 4;
  bool is_significant() const;
};

/// Of what the first sees of the map, in the second. matches: of the features of the two.
ReprojectionInconsistency reprojection_inconsistency(const Map& map, const Keyframe& first,
                                                     const Keyframe& second,
                                                     const std::vector<Match>& matches);

/// The newest keyframe against the one before it, by features matched anew: a map keeps only observations
/// that agree with it. Live; a finished map is held against the view graph (graph_consistency.h).
ReprojectionInconsistency newest_inconsistency(const Map& map, const MatchOptions& matching);

}  // namespace mono_pose_tracker
