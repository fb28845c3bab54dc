#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/mapping/matches_in_time.h"

namespace mono_pose_tracker {

/// Two keyframes that follow each other, and how much of what they see of the map speaks against it.
struct Contradiction {
  std::int64_t frame_index = -1;  // of the second; -1: there were none to compare
  int matches = 0;                // of landmarks, by descriptors alone
  int contradicting = 0;          // of them: the landmark lies elsewhere in the second image

  double share() const { return matches > 0 ? static_cast<double>(contradicting) / matches : 0; }

  /// In a right map one match in twenty lies elsewhere at most, a wrong match or something that moves by
  /// itself. One in seven is a part of the scene that has gone another way than the map says, even if each of
  /// its sides looks well by itself; one in ten is, where so many are not in a right map by chance.
  static constexpr double kOfARightMap = 1.0 / 20, kMostOfARightMap = 1.0 / 10, kOfAWrongMap = 1.0 / 7;
  /// Standard deviations of a count: by chance once in 30,000 pairs.
  static constexpr double kDeviations = 4;
  bool is_significant() const;
  /// A large share of a few may be chance, and is not as bad as a smaller one that is not.
  bool is_worse_than(const Contradiction& other) const;
};

/// Of what the first sees of the map, in the second. matches: of the features of the two.
Contradiction contradiction_between(const Map& map, const Keyframe& first, const Keyframe& second,
                                    const std::vector<Match>& matches);

/// The same both ways: also of what the second sees, in the first.
struct ContradictionBothWays {
  Contradiction onward, back;
  bool is_significant() const { return onward.is_significant() || back.is_significant(); }
};
ContradictionBothWays contradiction_both_ways(const Map& map, const Keyframe& first, const Keyframe& second,
                                              const std::vector<Match>& matches);

/// The worst pair of keyframes that follow each other in time. Observations are not asked, since a map keeps
/// only those that agree with it: features are matched anew, and where a matched landmark should be seen is
/// compared with where it is. A repeated pattern is seen elsewhere and where it should be: it says nothing.
/// matches: of the map's keyframes.
Contradiction worst_contradiction(const Map& map, const MatchesInTime& matches);

/// The same of the newest keyframe and the one before it, matched anew.
Contradiction newest_contradiction(const Map& map, const MatchOptions& matching);

}  // namespace mono_pose_tracker
