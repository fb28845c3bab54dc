#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "io/image_source.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "pipeline/recording_result.h"
#include "pipeline/self_calibration.h"
#include "tracking/feature_memory.h"

namespace mono_pose_tracker {

class ObjectMasks;

/// The parts of the work on a recording. Refining and registering take turns.
enum class RecordingStage { kTracking, kRefining, kRegistering, kWriting };

/// A recording to be tracked: all images, in order.
struct Recording {
  /// From the beginning; called again for images to be registered later.
  std::function<std::unique_ptr<ImageSource>()> open;
  const MaskFolder* masks = nullptr;
  const SavedMaps* loaded = nullptr;    // maps that RecordingPipeline continues; null: none
  FeatureMemoryOptions feature_memory;  // of RecordingPipeline
  std::int64_t max_frames = -1;         // all
  std::size_t most_held = 1000;  // images to be registered later, held at once: half a gigabyte of features
  /// With more than one, images are read and features are extracted ahead of tracking; the results are the
  /// same.
  int threads = 1;
  /// Returns true to stop reading images. Called on any thread.
  std::function<bool()> interrupted = [] { return false; };
  /// Called as each stage begins.
  std::function<void(RecordingStage)> begin_stage = [](RecordingStage) {};

  // Of one run; RecordingPipeline sets them.
  std::int64_t first_tracked = 0;                   // images before it are registered in the end
  std::shared_ptr<const ObjectMasks> object_masks;  // masks found by an earlier run; null: none
  std::shared_ptr<FeatureMemory> features;          // features found by earlier runs; null: none
  /// Made in parallel with the other checks of the finished map, where `threads` is more than one.
  std::optional<CalibrationTest> calibration_test;
};

/// Called with the report of each frame as it comes. index counts the readable images, as in RecordingResult.
/// `pass` 2: registered in the finished map.
using FrameObserver = std::function<void(int pass, std::int64_t index, const FrameReport&)>;

/// One run: tracks the recording with inline mapping until it ends or is interrupted, finishes the map, and
/// registers the images that have no pose yet.
RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker);

}  // namespace mono_pose_tracker
