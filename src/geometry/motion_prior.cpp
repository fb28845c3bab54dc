#include "geometry/motion_prior.h"

#include <utility>

#include "common/median.h"
#include "common/time_stamp.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kLeastChanges = 8;
// sigmas; a fifth more than the greatest change of the cameras whose truth is known.
constexpr double kBelief = 17;
constexpr double kMedianOfThreeSquares = 2.366;  // of chi squared with three degrees of freedom

}  // namespace

VelocityChange::VelocityChange(const TimedCenter& before, const TimedCenter& at, const TimedCenter& after)
    : seconds_before(seconds_between(before.stamp_ns, at.stamp_ns)),
      seconds_after(seconds_between(at.stamp_ns, after.stamp_ns)),
      per_second((after.center - at.center) / seconds_after - (at.center - before.center) / seconds_before) {}

MotionPrior::MotionPrior(const std::vector<TimedCenter>& in_time) {
  std::vector<double> densities;
  for (std::size_t i = 1; i + 1 < in_time.size(); ++i) {
    const VelocityChange change(in_time[i - 1], in_time[i], in_time[i + 1]);
    if (!change.is_timed()) continue;
    densities.push_back(3 * change.per_second.squaredNorm() / (change.seconds_before + change.seconds_after));
  }
  if (densities.size() >= kLeastChanges) density_ = median(std::move(densities)) / kMedianOfThreeSquares;
}

bool MotionPrior::is_beyond(const VelocityChange& change, double least) const {
  if (density_ <= 0 || !change.is_timed()) return false;
  const double size = change.per_second.norm();
  const double off_line = size / (1 / change.seconds_before + 1 / change.seconds_after);
  return size > kBelief * sigma_of(change) && off_line > least;
}

}  // namespace mono_pose_tracker
