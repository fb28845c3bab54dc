#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>

#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "pipeline/recording.h"
#include "pipeline/self_calibration.h"

namespace mono_pose_tracker {

/// How a recording is tracked again.
struct RecordingPipelineOptions {
  /// Sampled images at equal distances: every ninth in a minute at 30 Hz, between which a head rotates little
  /// enough for matching. Their features take some hundred megabytes at most.
  std::int64_t sampled_images = 200;
  std::array<double, 4> seeds = {0, 0.5, 0.25, 0.75};  // shares of the recording, as far apart as possible
  int most_objects = 3;                                // a head, the shoulders below it, the room behind
  double plainly_larger = 1.2;  // minimum ratio of sizes, as in MotionEvidence::is_larger
};

/// The camera of a recording, and what is asked of it.
struct RecordingCamera {
  CameraParameters parameters;
  CalibrationSource source = CalibrationSource::kGiven;
  bool is_to_be_refined = false;
};

struct TrackedRecording {
  int attempt = 0;         // of the result
  FrameObserver observer;  // of the attempt: what it owns is freed with a result that is not kept
  std::unique_ptr<Tracker> tracker;
  RecordingResult result;
  SelfCalibration calibration;                      // of a given camera: 0 runs
  std::shared_ptr<const ObjectMasks> object_masks;  // with which it was tracked; null: none
};

/// Called as an attempt begins: 0 with each camera, then 1, 2, ... from other seeds or with other masks.
using ObserverOfAttempt = std::function<FrameObserver(int attempt)>;

/// Builds the map of a recording, judges it, and tries alternatives while it is in doubt. One thread.
///
///     RecordingPipeline pipeline(recording, options, {camera}, observer_of);
///     const TrackedRecording tracked = pipeline.run();
///     if (is_confirmed(tracked.result)) ...
class RecordingPipeline {
 public:
  /// Attempt that tracks only the beginning of the recording, to refine the camera.
  static constexpr int kBeginning = -1;

  RecordingPipeline(Recording recording, const TrackerOptions& options, RecordingCamera camera,
                    ObserverOfAttempt observer_of);

  /// Once. A loaded map is continued by one run with the given camera. The last run is with the returned one.
  TrackedRecording run();

 private:
  using Masks = std::shared_ptr<const ObjectMasks>;

  void begin_with(const CameraParameters& camera);
  TrackedRecording track(double seed, const Masks& masks, int max_keyframes = 0);
  bool try_seeds(std::size_t first_index, const Masks& masks);
  bool exclude_background();
  bool switch_to_larger_object();
  bool switch_to_rotating_object();
  TrackedRecording track_most_rotating_object(double seed, Masks masks);
  bool is_in_doubt() const;
  bool can_track_with(const Masks& masks) const;
  void report_smaller_object(double share);
  void report_calibration();

  Recording recording_;
  const TrackerOptions options_;
  RecordingCamera given_;
  const ObserverOfAttempt observer_of_;
  CameraRefinementOptions refinement_;
  CameraParameters camera_;  // of the present runs
  int attempts_ = 0;         // with this camera
  TrackedRecording kept_;    // the best so far
};

/// The tracker of one run, in the loaded maps (null: none). Throws std::invalid_argument on options out of
/// range, or maps of other features.
std::unique_ptr<Tracker> make_tracker(const TrackerOptions& options, const CameraParameters& camera,
                                      const SavedMaps* loaded);

}  // namespace mono_pose_tracker
