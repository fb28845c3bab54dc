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

  /// The share in a right map is at most this, from wrong matches and moving objects.
  static constexpr double kMostOfARightMap = 1.0 / 10;
  /// Probability of as many contradicting matches in a right map (exact binomial tail).
  double p_value() const;
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
