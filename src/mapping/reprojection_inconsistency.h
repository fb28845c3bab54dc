#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Reprojection inconsistency of two consecutive keyframes: the share of their common landmarks that project
/// elsewhere.
struct ReprojectionInconsistency {
  std::int64_t frame_index = -1;  // of the second; -1: nothing was compared
  int matches = 0;                // number of landmark matches, by descriptors alone
  int contradicting = 0;          // matches far from the projected landmark in the second image

  double share() const { return matches > 0 ? static_cast<double>(contradicting) / matches : 0; }

  /// Shares of inconsistent matches. In a right map it is one in twenty at most, from wrong matches or moving
  /// objects, and one in ten is rare. One in seven means that a part of the scene is misregistered, even if
  /// each of its sides is consistent by itself.
  static constexpr double kOfARightMap = 1.0 / 20, kMostOfARightMap = 1.0 / 10, kOfAWrongMap = 1.0 / 7;
  /// Standard deviations of a count. The exact tail probability of the smallest significant count (8 of 56)
  /// is 1 in 154.
  static constexpr double kDeviations = 4;
  bool is_significant() const;
};

/// The inconsistency of the landmarks of the first keyframe in the second. matches: between the features of
/// the two.
ReprojectionInconsistency reprojection_inconsistency(const Map& map, const Keyframe& first,
                                                     const Keyframe& second,
                                                     const std::vector<Match>& matches);

/// The inconsistency of the newest keyframe with the one before, by newly matched features, as a map keeps
/// only consistent observations. For live maps; a finished map is compared with the view graph
/// (graph_consistency.h).
ReprojectionInconsistency newest_inconsistency(const Map& map, const MatchOptions& matching);

}  // namespace mono_pose_tracker
