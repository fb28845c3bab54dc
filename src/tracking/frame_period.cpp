#include "tracking/frame_period.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace mono_pose_tracker {

void FramePeriod::note(double stamp_s, double arrival_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double stamp_gap = stamp_s - std::exchange(last_stamp_s_, stamp_s);
  const double arrival_gap = arrival_s - std::exchange(last_arrival_s_, arrival_s);
  if (!std::exchange(has_last_, true) || !is_gap(stamp_gap) || arrival_gap >= options_.pause_s) return;
  stamp_gaps_s_[noted_ % kKept] = stamp_gap;
  arrival_gaps_s_[noted_ % kKept] = std::max(arrival_gap, 0.0);
  ++noted_;
}

bool FramePeriod::has_come_after(double arrival_s) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return has_last_ && last_arrival_s_ > arrival_s;
}

double FramePeriod::milliseconds() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (noted_ < options_.least_gaps) return 0;
  const std::size_t kept = std::min(noted_, kKept);
  std::array<double, kKept> gaps = stamp_gaps_s_;
  const auto quartile = gaps.begin() + static_cast<std::ptrdiff_t>(kept / 4);
  std::nth_element(gaps.begin(), quartile, gaps.begin() + static_cast<std::ptrdiff_t>(kept));
  const double arrivals = std::accumulate(arrival_gaps_s_.begin(), arrival_gaps_s_.end(), 0.0);
  return 1e3 * std::max(*quartile, arrivals / static_cast<double>(kept));
}

}  // namespace mono_pose_tracker
