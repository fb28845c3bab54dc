#include "tracking/load_governor.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace mono_pose_tracker {

constexpr FramePeriodOptions kPeriod{};
constexpr LoadGovernorOptions kGovernor{};

void FramePeriod::note(double stamp_s, double arrival_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double stamp_gap = stamp_s - std::exchange(last_stamp_s_, stamp_s);
  const double arrival_gap = arrival_s - std::exchange(last_arrival_s_, arrival_s);
  if (!std::exchange(has_last_, true) || stamp_gap <= 0) return;
  if (std::max(stamp_gap, arrival_gap) >= kPeriod.pause_s) return;
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
  if (noted_ < kPeriod.least_gaps) return 0;
  const std::size_t kept = std::min(noted_, kKept);
  std::array<double, kKept> gaps = stamp_gaps_s_;
  const auto quartile = gaps.begin() + static_cast<std::ptrdiff_t>(kept / 4);
  std::nth_element(gaps.begin(), quartile, gaps.begin() + static_cast<std::ptrdiff_t>(kept));
  const double arrivals = std::accumulate(arrival_gaps_s_.begin(), arrival_gaps_s_.end(), 0.0);
  return 1e3 * std::max(*quartile, arrivals / static_cast<double>(kept));
}

int LoadGovernor::observe(double period_ms, double latency_ms, bool overtaken) {
  mean_ms_ = since_change_ < kGovernor.held_up ? latency_ms
                                               : mean_ms_ + kGovernor.mean_weight * (latency_ms - mean_ms_);
  ++since_change_;
  since_overtaken_ = overtaken ? 0 : since_overtaken_ + 1;
  if (period_ms <= 0) return level_;
  if (level_ == kTimeToSpare && mean_ms_ > kGovernor.no_longer_spare * period_ms) do_less();
  const double to_spare = level_ == kTimeToSpare ? 0 : kGovernor.to_spare[static_cast<std::size_t>(level_)];
  calm_ = mean_ms_ < to_spare * period_ms ? calm_ + 1 : 0;
  if (since_change_ < kGovernor.settling) return level_;
  const bool is_late = mean_ms_ > kGovernor.too_late * period_ms && since_overtaken_ < kGovernor.settling;
  if (is_late && level_ < kCoarserOctave) {
    do_less();
  } else if (calm_ >= calm_needed_ && level_ > kTimeToSpare) {
    went_back_up_ = true;
    change_level(level_ - 1);
  }
  if (level_ <= kFullWork && since_change_ > kGovernor.most_calm) calm_needed_ = kGovernor.least_calm;
  return level_;
}

// A level that failed is tried again after growing intervals.
void LoadGovernor::do_less() {
  const bool did_not_hold = went_back_up_ && since_change_ < 2 * kGovernor.least_calm;
  calm_needed_ = did_not_hold ? std::min(2 * calm_needed_, kGovernor.most_calm) : calm_needed_;
  went_back_up_ = false;
  change_level(level_ + 1);
}

void LoadGovernor::change_level(int level) {
  level_ = level;
  since_change_ = 0;
  calm_ = 0;
}

}  // namespace mono_pose_tracker
