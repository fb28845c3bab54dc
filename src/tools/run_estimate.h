#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "pipeline/recording.h"

namespace mono_pose_tracker {

/// Duration of the stages after tracking, as shares of the duration of tracking.
struct RunEstimateOptions {
  double refining = 1.0, registering = 0.15, writing = 0.1;
};

/// Estimates how long the work on a recording still takes. Tracking is counted in images. Of the other stages
/// nobody knows the amount of work: the rest of one decays exponentially with the time spent in it, so that
/// it always shrinks. Times are in seconds, from any clock, and do not decrease. One thread.
///
///     RunEstimate estimate(images);
///     estimate.begin(RecordingStage::kTracking, now());
///     for (...) estimate.count_image();
///     estimate.share_done(now());
class RunEstimate {
 public:
  /// images: not positive: not known; then nothing can be said during tracking.
  explicit RunEstimate(std::int64_t images, const RunEstimateOptions& options = {})
      : images_(images), shares_{1, options.refining, options.registering, options.writing} {}

  /// Tracking that begins again is a further run over the recording.
  void begin(RecordingStage stage, double now);
  void count_image() { ++tracked_; }
  /// Nothing before the first image has been tracked.
  std::optional<double> seconds_left(double now) const;
  /// 0 to 1; it never falls.
  double share_done(double now);

 private:
  static constexpr std::size_t kStages = 4;

  double spent_in(std::size_t stage, double now) const;

  const std::int64_t images_;
  const std::array<double, kStages> shares_;
  std::int64_t tracked_ = 0;
  RecordingStage stage_ = RecordingStage::kTracking;
  std::optional<double> start_, stage_start_;
  std::array<double, kStages> spent_{};  // before the present stage, in this run
  double share_ = 0;
};

inline void RunEstimate::begin(RecordingStage stage, double now) {
  if (!start_) start_ = now;
  if (stage_start_) spent_[static_cast<std::size_t>(stage_)] += now - *stage_start_;
  if (stage == RecordingStage::kTracking) {
    tracked_ = 0;
    spent_.fill(0);
  }
  stage_ = stage;
  stage_start_ = now;
}

inline double RunEstimate::spent_in(std::size_t stage, double now) const {
  const bool is_present = stage_start_ && stage == static_cast<std::size_t>(stage_);
  return spent_[stage] + (is_present ? now - *stage_start_ : 0);
}

inline std::optional<double> RunEstimate::seconds_left(double now) const {
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

inline double RunEstimate::share_done(double now) {
  const std::optional<double> left = seconds_left(now);
  if (left) share_ = std::max(share_, (now - *start_) / std::max(1e-3, now - *start_ + *left));
  return share_;
}

}  // namespace mono_pose_tracker
