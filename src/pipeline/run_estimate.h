#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "pipeline/recording_stage.h"

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
  explicit RunEstimate(std::int64_t images, const RunEstimateOptions& options = {});

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

}  // namespace mono_pose_tracker
