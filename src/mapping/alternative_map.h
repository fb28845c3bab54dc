#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Compares a map with an alternative hypothesis that explains its images about as well (depth_reversal.h,
/// planar_ambiguity.h): both are adjusted, and their costs decide.
struct AlternativeMapOptions {
  double outlier_sigmas = 2.5;                    // at which an observation's cost is capped
  int trial_iterations = 8, max_iterations = 25;  // of an adjustment: first ones, and the further ones
  double far_higher_cost = 3;  // a cost higher by this factor after the first iterations is
                               // not brought near by further ones

  double min_extra_cost = 0.1;  // share of the map's cost: where both are equally wrong, the costs differ by
                                // less, and the map has the advantage that its outliers were removed

  // Sample of the landmarks.
  int enough_of_keyframe = 60;       // observations that suffice to compare costs, twenty times as many
                                     // as for a pose
  std::size_t enough_of_map = 2000;  // observations, for a ratio of costs accurate to 3 %
  double sampled_margin = 1.1;       // ratio of costs of samples, three times that

  // Depth reversal.
  double narrow = 0.15;   // rad, rms about the mean bearing: 8.6 degrees, below which a map may be reversed
  double max_tilt = 1.4;  // rad: beyond, another side of the object is visible
  std::array<double, 3> reversed_stretches = {1, 2.5, 6};  // of a reversed map: bundle adjustment finds the
                                                           // right one from within a factor of two
  std::array<double, 4> stretches = {0.4, 2.5, 6, 15};     // of a map that is not reversed
  int max_stretched_rounds = 4;  // of adjustments: all maps of real heads and busts converge back in
                                 // the first ones

  // Planar ambiguity.
  int min_shared = 60;         // common landmarks of two keyframes: with fewer, an alternative fits by chance
  int min_inliers = 15;        // of an absolute pose, as in the tracker
  std::size_t beginning = 24;  // keyframes at the beginning that are compared: the others were registered
                               // relative to these, and every alternative takes adjustments of them all
};
inline constexpr AlternativeMapOptions kAlternativeMaps{};

/// Probability that the alternative costs so much more than the map by chance, if it were no worse: Student's
/// t-test of the differences of the landmarks' costs (Vuong 1989). The errors of a landmark are correlated,
/// as its features drift along the track, so that each landmark counts as one. Observations that the
/// alternative has lost cost as much as outliers. 1 where it costs less than min_extra_cost more.
double p_value_of(const Map& alternative, const Map& map,
                  double min_extra_cost = kAlternativeMaps.min_extra_cost);

/// The map with every n-th landmark, where keyframes have far more observations than a comparison needs.
/// Keyframes with few observations keep all of them. The sample is adjusted as the alternatives are. Nothing
/// where no landmark would be dropped.
std::optional<Map> sample_of(const BundleOptions& bundle, const Map& map);

/// Sum of squared errors, each capped.
inline double cost_of(const Map& map) {
  constexpr double cap = kAlternativeMaps.outlier_sigmas * kAlternativeMaps.outlier_sigmas;
  double cost = 0;
  for (const auto& entry : map.keyframes()) {
    const Keyframe& keyframe = entry.second;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
      if (!landmark) continue;
      const double error = error_px(keyframe, static_cast<int>(f), landmark->x_in_map);
      cost += std::min(error * error, cap);
    }
  }
  return cost;
}

}  // namespace mono_pose_tracker
