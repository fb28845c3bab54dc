#include "tracking/load_governor.h"

#include <algorithm>

namespace mono_pose_tracker {

double LoadGovernor::share_to_spare() const {
  return level_ == kTimeToSpare ? 0 : options_.to_spare[static_cast<std::size_t>(level_)];
}

int LoadGovernor::observe(double period_ms, double latency_ms, bool overtaken) {
  mean_ms_ = since_change_ < options_.held_up ? latency_ms
                                              : mean_ms_ + options_.mean_weight * (latency_ms - mean_ms_);
  ++since_change_;
  since_overtaken_ = overtaken ? 0 : since_overtaken_ + 1;
  if (period_ms <= 0) return level_;
  if (level_ == kTimeToSpare && mean_ms_ > options_.no_longer_spare * period_ms) do_less();
  calm_ = mean_ms_ < share_to_spare() * period_ms ? calm_ + 1 : 0;
  if (since_change_ < options_.settling) return level_;
  const bool is_late = mean_ms_ > options_.too_late * period_ms && since_overtaken_ < options_.settling;
  if (is_late && level_ < kCoarserOctave) {
    do_less();
  } else if (calm_ >= calm_needed_ && level_ > kTimeToSpare) {
    went_back_up_ = true;
    change_level(level_ - 1);
  }
  if (level_ <= kFullWork && since_change_ > options_.most_calm) calm_needed_ = options_.least_calm;
  return level_;
}

// A level that failed is tried again after growing intervals.
void LoadGovernor::do_less() {
  const bool did_not_hold = went_back_up_ && since_change_ < 2 * options_.least_calm;
  calm_needed_ = did_not_hold ? std::min(2 * calm_needed_, options_.most_calm) : calm_needed_;
  went_back_up_ = false;
  change_level(level_ + 1);
}

void LoadGovernor::change_level(int level) {
  level_ = level;
  since_change_ = 0;
  calm_ = 0;
}

}  // namespace mono_pose_tracker
