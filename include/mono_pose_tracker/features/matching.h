#pragma once

#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/common/cancel_flag.h"

namespace mono_pose_tracker {

/// Squared Euclidean distance of two descriptors of 128 bytes.
int descriptor_distance2(const std::uint8_t* a, const std::uint8_t* b);

/// The stored squared distance for a distance between unit descriptors, which are stored with norm 512.
inline int stored_distance2(double unit_distance) {
  const double stored = 512 * unit_distance;
  return static_cast<int>(stored * stored);
}

/// The nearest candidate so far and the distance of the second nearest.
struct NearestTwo {
  int index = -1;
  int best = std::numeric_limits<int>::max();
  int second = std::numeric_limits<int>::max();

  void offer(int candidate, int distance2) {
    if (distance2 < best) {
      second = best;
      best = distance2;
      index = candidate;
    } else if (distance2 < second) {
      second = distance2;
    }
  }

  /// Merges the result of other candidates, as if they had been offered here afterwards.
  void take(const NearestTwo& later) {
    if (later.best < best) {
      second = std::min(best, later.second);
      best = later.best;
      index = later.index;
    } else {
      second = std::min(second, later.best);
    }
  }
};

struct Match {
  int first = -1;
  int second = -1;
  int distance2 = 0;  // squared descriptor distance
  float ratio = 0;    // nearest over second nearest distance, in (0, 1]; smaller is more distinct
};

/// Of the second to the first.
std::vector<Match> turned_round(std::vector<Match> matches);

struct MatchOptions {
  double min_ratio = 1.25;         // second nearest over nearest distance at least (the paper, step 3a)
  bool mutual = true;              // the nearest of the second must be the first, too
  CancelFlag cancelled = nullptr;  // once it is set: no matches
};

/// Putative matches (paper, step 3a): rows of `first` to rows of `second` (N x 128, CV_8U), ordered by first.
/// A row is matched at most once on either side when mutual. Neighbours are exact (exhaustive search).
std::vector<Match> match_descriptors(const cv::Mat& first, const cv::Mat& second,
                                     const MatchOptions& options);

}  // namespace mono_pose_tracker
