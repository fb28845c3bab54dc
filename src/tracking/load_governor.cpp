#include "tracking/load_governor.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

constexpr double kMeanWeight = 0.1;  // of the newest latency
// Share of the period: above it, images are dropped as soon as one takes a little longer.
constexpr double kTooLate = 0.9;
// Share of the period: optional work must leave time to other programs.
constexpr double kNoLongerSpare = 0.5;
// Share of the period at each level below which the next level up would still be in time. Drawing and
// mapping, on a thread of its own, take little time from tracking. Twice the features or a finer octave take
// nearly twice the time. An octave finer than usual has four times the pixels and up to twice the features:
// eight times.
double share_to_spare(int level) {
  constexpr double kShares[] = {0.125, 0.75, 0.75, 0.5, 0.5};
  return level == kTimeToSpare ? 0 : kShares[level];
}

constexpr int kHeldUp = 5;       // images after a change that may have waited for an earlier one
constexpr int kSettling = 15;    // images after a change until it shows in the mean
constexpr int kLeastCalm = 90;   // images; three seconds at 30 Hz
constexpr int kMostCalm = 1440;  // four doublings: a failing level is tried once in 48 s

}  // namespace

int LoadGovernor::observe(double period_ms, double latency_ms, bool overtaken) {
  mean_ms_ = since_change_ < kHeldUp ? latency_ms : mean_ms_ + kMeanWeight * (latency_ms - mean_ms_);
  ++since_change_;
  since_overtaken_ = overtaken ? 0 : since_overtaken_ + 1;
  if (period_ms <= 0) return level_;
  if (level_ == kTimeToSpare && mean_ms_ > kNoLongerSpare * period_ms) do_less();
  calm_ = mean_ms_ < share_to_spare(level_) * period_ms ? calm_ + 1 : 0;
  if (since_change_ < kSettling) return level_;
  const bool is_late = mean_ms_ > kTooLate * period_ms && since_overtaken_ < kSettling;
  if (is_late && level_ < kCoarserOctave) {
    do_less();
  } else if (calm_ >= calm_needed_ && level_ > kTimeToSpare) {
    went_back_up_ = true;
    change_level(level_ - 1);
  }
  if (level_ <= kFullWork && since_change_ > kMostCalm) calm_needed_ = kLeastCalm;
  return level_;
}

// A level that failed is tried again after growing intervals.
void LoadGovernor::do_less() {
  const bool did_not_hold = went_back_up_ && since_change_ < 2 * kLeastCalm;
  calm_needed_ = did_not_hold ? std::min(2 * calm_needed_, kMostCalm) : calm_needed_;
  went_back_up_ = false;
  change_level(level_ + 1);
}

void LoadGovernor::change_level(int level) {
  level_ = level;
  since_change_ = 0;
  calm_ = 0;
}

}  // namespace mono_pose_tracker
