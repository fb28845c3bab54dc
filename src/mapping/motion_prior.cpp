#include "motion_prior.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "keyframe_landmarks.h"

namespace mono_pose_tracker {

namespace {

// Of three keyframes in a row.
struct Acceleration {
  double value = 0;      // map units / s^2
  double deviation = 0;  // of the last position from the one expected of the two before, map units; the same
                         // for the first and the two after it
};

Acceleration acceleration_of(const Keyframe& a, const Keyframe& b, const Keyframe& c) {
  constexpr double kNanosecond = 1e-9, kShortest = 1e-6;  // s
  const double before = std::max(kShortest, kNanosecond * static_cast<double>(b.stamp_ns - a.stamp_ns)),
               after = std::max(kShortest, kNanosecond * static_cast<double>(c.stamp_ns - b.stamp_ns));
  const Eigen::Vector3d change =
      (c.center_in_map() - b.center_in_map()) / after - (b.center_in_map() - a.center_in_map()) / before;
  return {2 * change.norm() / (before + after), change.norm() * std::min(before, after)};
}

// Probability that the sum of the squares of three standard normal variables exceeds squared.
double chi_square_3_tail(double squared) {
  return std::erfc(std::sqrt(squared / 2)) + std::sqrt(2 * squared / kPi) * std::exp(-squared / 2);
}

}  // namespace

std::set<KeyframeId> off_motion(const Map& map, const MotionPriorOptions& options) {
  constexpr double kMedianOfNorm = 1.538;  // of three standard normal variables
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  std::set<KeyframeId> off;
  if (in_time.size() < options.fewest + 2) return off;
  std::vector<Acceleration> accelerations;  // the k-th is of keyframes k to k + 2
  std::vector<double> values;
  double length = 0;
  for (std::size_t k = 0; k + 1 < in_time.size(); ++k) {
    length += (in_time[k + 1]->center_in_map() - in_time[k]->center_in_map()).norm();
    if (k + 2 == in_time.size()) break;
    accelerations.push_back(acceleration_of(*in_time[k], *in_time[k + 1], *in_time[k + 2]));
    values.push_back(accelerations.back().value);
  }
  const double sigma = median(std::move(values)) / kMedianOfNorm;
  if (sigma <= 0) return off;
  const auto contradicts = [&](const Acceleration& acceleration) {
    return acceleration.deviation > 3 * options.max_path_sigma * length &&
           chi_square_3_tail(std::pow(acceleration.value / sigma, 2)) <
               options.significance / static_cast<double>(in_time.size());
  };
  for (std::size_t k = 2; k < accelerations.size(); ++k) {
    if (contradicts(accelerations[k - 2]) && contradicts(accelerations[k])) off.insert(in_time[k]->id);
  }
  return off;
}

}  // namespace mono_pose_tracker
