#include "pipeline/run_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace mono_pose_tracker {

RunEstimate::RunEstimate(std::int64_t images, const RunEstimateOptions& options)
    : images_(images), shares_{1, options.refining, options.registering, options.writing} {}

void RunEstimate::begin(RecordingStage stage, double now) {
  if (!start_) start_ = now;
  if (stage_start_) spent_[static_cast<std::size_t>(stage_)] += now - *stage_start_;
  if (stage == RecordingStage::kTracking) {
    tracked_ = 0;
    spent_.fill(0);
  }
  stage_ = stage;
  stage_start_ = now;
}

double RunEstimate::spent_in(std::size_t stage, double now) const {
  const bool is_present = stage_start_ && stage == static_cast<std::size_t>(stage_);
  return spent_[stage] + (is_present ? now - *stage_start_ : 0);
}

std::optional<double> RunEstimate::seconds_left(double now) const {
  const bool tracks = stage_ == RecordingStage::kTracking;
  if (tracked_ == 0 || (tracks && images_ <= 0)) return std::nullopt;
  const double for_tracking = spent_in(0, now);
  const double left_share =
      tracks ? std::max(0.0, static_cast<double>(images_ - tracked_) / static_cast<double>(tracked_)) : 0;
  double left = left_share * for_tracking;
  const bool writes = stage_ == RecordingStage::kWriting;
  for (std::size_t stage = writes ? kStages - 1 : 1; stage < kStages; ++stage) {
    const double expected = std::max(1e-3, shares_[stage] * (1 + left_share) * for_tracking);
    left += expected * std::exp(-spent_in(stage, now) / expected);
  }
  return left;
}

double RunEstimate::share_done(double now) {
  const std::optional<double> left = seconds_left(now);
  if (left) share_ = std::max(share_, (now - *start_) / std::max(1e-3, now - *start_ + *left));
  return share_;
}

}  // namespace mono_pose_tracker
