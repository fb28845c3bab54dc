#include "motion_prior.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "common/time_stamp.h"
#include "keyframe_landmarks.h"

namespace mono_pose_tracker {

namespace {

constexpr MotionPriorOptions kMotionPrior{};

using Keyframes = std::vector<const Keyframe*>;

// Of three keyframes.
struct Acceleration {
  double value = 0;      // map units / s^2
  double deviation = 0;  // of the first or the last position from the one expected of the two others: the
                         // smaller one, map units
};

Acceleration acceleration_of(const Keyframe& a, const Keyframe& b, const Keyframe& c) {
  const double shortest = 1e-6;  // s, for stamps that are equal
  const double before = std::max(shortest, seconds_between(a.stamp_ns, b.stamp_ns)),
               after = std::max(shortest, seconds_between(b.stamp_ns, c.stamp_ns));
  const Eigen::Vector3d change =
      (c.center_in_map() - b.center_in_map()) / after - (b.center_in_map() - a.center_in_map()) / before;
  return {2 * change.norm() / (before + after), change.norm() * std::min(before, after)};
}

// Probability that the sum of the squares of three standard normal variables exceeds squared.
double chi_square_3_tail(double squared) {
  return std::erfc(std::sqrt(squared / 2)) + std::sqrt(2 * squared / kPi) * std::exp(-squared / 2);
}

Keyframes of_this_run(const Map& map) {
  Keyframes in_time = keyframes_in_time(map);
  in_time.erase(std::remove_if(in_time.begin(), in_time.end(),
                               [](const Keyframe* k) { return is_of_earlier_run(k->frame_index); }),
                in_time.end());
  return in_time;
}

// The gate for the accelerations of these keyframes.
class Gate {
 public:
  explicit Gate(const Keyframes& in_time)
      : p_value_(kMotionPrior.significance / static_cast<double>(in_time.size())) {
    std::vector<double> values;
    for (std::size_t k = 0; k + 2 < in_time.size(); ++k)
      values.push_back(acceleration_of(*in_time[k], *in_time[k + 1], *in_time[k + 2]).value);
    least_deviation_ = 3 * kMotionPrior.max_path_sigma * path_lengths(in_time).back();
    variance_ = variance_of_median_square(std::pow(median(std::move(values)), 2));
  }

  bool contradicts(const Keyframe* a, const Keyframe* b, const Keyframe* c) const {
    const Acceleration acceleration = acceleration_of(*a, *b, *c);
    return acceleration.deviation > least_deviation_ && variance_ > 0 &&
           chi_square_3_tail(std::pow(acceleration.value, 2) / variance_) < p_value_;
  }

 private:
  double p_value_, least_deviation_ = 0, variance_ = 0;
};

}  // namespace

std::set<KeyframeId> off_motion(const Map& map) {
  const Keyframes in_time = of_this_run(map);
  std::set<KeyframeId> off;
  if (in_time.size() < kMotionPrior.fewest + 2) return off;
  const Gate gate(in_time);
  for (const std::size_t row : {1, 2}) {  // keyframes [k, k + row)
    for (std::size_t k = 2; k + row + 1 < in_time.size(); ++k) {
      const Keyframe *const *before = &in_time[k - 2], *const *first = &in_time[k],
                            *const *last = &in_time[k + row - 1], *const *after = &in_time[k + row];
      if (gate.contradicts(before[0], before[1], *first) && gate.contradicts(*last, after[0], after[1]) &&
          !gate.contradicts(before[0], before[1], after[0]) &&
          !gate.contradicts(before[1], after[0], after[1])) {
        for (std::size_t i = k; i < k + row; ++i) off.insert(in_time[i]->id);
      }
    }
  }
  return off;
}

}  // namespace mono_pose_tracker
