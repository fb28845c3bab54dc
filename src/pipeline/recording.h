#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "mapping/loop_closer.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "pipeline/recording_stage.h"
#include "tracking/feature_memory.h"
#include "tracking/finished_map.h"

namespace mono_pose_tracker {

class ObjectMasks;

/// A recording to be tracked: all images, in order.
struct Recording {
  std::function<std::unique_ptr<ImageSource>()>
      open;  // from the beginning; called again for images to be registered later
  const MaskFolder* masks = nullptr;
  std::shared_ptr<const ObjectMasks> object_masks;  // masks found by an earlier run; null: none
  std::shared_ptr<FeatureMemory> features;          // features found by earlier runs; null: none
  FeatureMemoryOptions feature_memory;              // of track_until_confirmed
  std::int64_t max_frames = -1;                     // all
  std::int64_t first_tracked = 0;                   // images before it are registered in the end
  std::size_t most_held = 1000;  // images to be registered later, held at once: half a gigabyte of features
  bool try_again = true;         // where a result is in doubt; not for a loaded map
  /// With more than one, images are read and features are extracted ahead of tracking; the results are the
  /// same.
  int threads = 1;
  /// Returns the caller's reason to doubt the finished map; empty: none. Called only where `threads` is more
  /// than one, on a thread of its own in parallel with the other checks. Its result is not needed once
  /// `cancelled` is true.
  std::function<std::string(const Map&, const std::function<bool()>& cancelled)> doubt_of;
  /// Returns true to stop reading images. Called on any thread.
  std::function<bool()> interrupted = [] { return false; };
  /// Called as each stage begins.
  std::function<void(RecordingStage)> begin_stage = [](RecordingStage) {};
};

struct RecordingResult {
  bool tracked = false;             // there is a map; otherwise `reason` has the cause
  bool rests_on_two_views = false;  // the map has two views that no third confirmed
  std::string reason;
  std::int64_t frames_total = 0;          // images that could be read
  std::int64_t frames_with_features = 0;  // of these: neither black nor of another size
  std::set<std::int64_t> unreadable;      // images skipped, counted with those that could be read
  std::vector<std::string> problems;      // one line for each image skipped or mask missing
  std::vector<std::string> warnings;      // why the result is doubtful and what to do
  std::optional<std::string> doubt;       // result of doubt_of, where it was called and the map is confirmed
  std::map<std::int64_t, std::string> names;  // of the images, by frame index
  std::vector<RegisteredFrame> trajectory;    // after the last optimisation, by index
  /// All maps that could not be merged and in which a frame is registered. `trajectory` is that of the first.
  std::vector<FinishedMap> maps;
  std::vector<ClosedLoop> loops;  // in any of the maps
  std::int64_t frames_posed_live = 0;
  std::set<std::int64_t> doubtful;  // frames of these: DOUBTFUL_POSE
  int failed_adjustments = 0;       // rejected bundle adjustments
  std::map<std::string, std::vector<double>> stage_ms;
};

/// Called with the report of each frame as it comes. index counts the readable images, as in RecordingResult.
/// `pass` 2: registered in the finished map.
using FrameObserver = std::function<void(int pass, std::int64_t index, const FrameReport&)>;

/// Tracks the recording with inline mapping until it ends or is interrupted, finishes the map, and registers
/// the images that have no pose yet.
RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker);

/// The verdict on the first map.
bool is_confirmed(const RecordingResult& result);

/// A finding about all maps of the result, such as one about the calibration; it becomes a warning.
void add_finding(Finding finding, RecordingResult* result);

struct TrackedRecording {
  int attempt = 0;         // of the result
  FrameObserver observer;  // of the attempt: what it owns is freed with a result that is not kept
  std::unique_ptr<Tracker> tracker;
  RecordingResult result;
};

using TrackerMaker = std::function<std::unique_ptr<Tracker>()>;
using ObserverOfAttempt = std::function<FrameObserver(int attempt)>;

/// How a recording is tracked again.
struct AttemptOptions {
  /// Sampled images at equal distances: every ninth in a minute at 30 Hz, between which a head rotates little
  /// enough for matching. Their features take some hundred megabytes at most.
  std::int64_t sampled_images = 200;
  std::array<double, 4> seeds = {0, 0.5, 0.25, 0.75};  // shares of the recording, as far apart as possible
  int most_objects = 3;                                // a head, the shoulders below it, the room behind
  double plainly_larger = 1.2;  // minimum ratio of sizes, as in MotionEvidence::is_larger
};

/// Tracks the recording. Where the result is not confirmed or an object's map is in several parts, tracks it
/// again from other seeds (half way, a quarter, three quarters) until one is confirmed: at most four times.
/// The better result is kept (is_better in result_choice.h).
///
/// Before that, the recording is tracked with masks derived from the results: of the moving object in front
/// of a static background; of the larger of two objects where the map is of the smaller; and of the object
/// that rotates, where segmentation/body asks for it and the map is of another one.
TrackedRecording track_until_confirmed(const Recording& recording, const TrackerMaker& make_tracker,
                                       const ObserverOfAttempt& observer_of,
                                       const AttemptOptions& options = {});

}  // namespace mono_pose_tracker
