#pragma once

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
#include "io/mask_folder.h"
#include "mapping/loop_closer.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "tracking/finished_map.h"

namespace mono_pose_tracker {

class ObjectMasks;
class FeatureMemory;

/// A recording to be tracked: every image, in order, none dropped.
struct Recording {
  std::function<std::unique_ptr<ImageSource>()>
      open;  // from its beginning; called once more for images to be posed later
  const MaskFolder* masks = nullptr;
  std::shared_ptr<const ObjectMasks> object_masks;  // masks that an earlier attempt has found; null: none
  std::shared_ptr<FeatureMemory> features;  // what earlier attempts have found in the images; null: none
  std::int64_t max_frames = -1;             // all
  std::int64_t first_tracked = 0;           // images before it are posed in the end
  std::size_t most_held = 1000;             // images to be posed later, at once: half a gigabyte of features
  bool try_again = true;                    // where a result is in doubt; of no use in a map that was loaded
  /// On more, images are read and searched for features ahead of tracking: the same results, sooner.
  int threads = 1;
  /// What the caller has to say against the finished map; empty: nothing. Asked only where `threads` is more
  /// than one, on a thread of its own beside the other checks. Once `cancelled`, nobody wants the answer.
  std::function<std::string(const Map&, const std::function<bool()>& cancelled)> doubt_of;
  /// True: no further image is read. Asked on any thread.
  std::function<bool()> interrupted = [] { return false; };
};

struct RecordingResult {
  bool tracked = false;             // there is a map; otherwise `reason` says why not
  bool rests_on_two_views = false;  // it does, and no third has confirmed it
  std::string reason;
  std::int64_t frames_total = 0;              // images that could be read
  std::int64_t frames_with_features = 0;      // of them: neither black nor of another size
  std::vector<std::string> problems;          // one line for each image skipped or mask missing
  std::vector<std::string> warnings;          // what makes the result doubtful and what to do
  std::optional<std::string> doubt;           // what doubt_of says, where it was asked and the map is sure
  std::map<std::int64_t, std::string> names;  // of the images, by frame index
  std::vector<RegisteredFrame> trajectory;    // after the last optimisation, by index
  /// All that could not be joined and in which a frame is posed; the trajectory is the first's.
  std::vector<FinishedMap> maps;
  std::vector<ClosedLoop> loops;  // in any of the maps
  std::int64_t frames_posed_live = 0;
  std::set<std::int64_t> doubtful;  // frames of these: DOUBTFUL_POSE
  int failed_adjustments = 0;       // bundle adjustments that were thrown away
  std::map<std::string, std::vector<double>> stage_ms;
};

/// Called with the report of each frame as it comes; index counts the images that could be read, as in
/// RecordingResult. `pass` 2: posed against the finished map.
using FrameObserver = std::function<void(int pass, std::int64_t index, const FrameReport&)>;

/// Tracks the recording with inline mapping, until it ends or is interrupted, finishes the map and poses
/// against it the images that have no pose yet.
RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker);

/// The verdict on the first map.
bool is_confirmed(const RecordingResult& result);

/// A finding about all maps of the result, such as one about the calibration; it becomes a warning.
void add_finding(Finding finding, RecordingResult* result);

struct TrackedRecording {
  int attempt = 0;  // that gave it
  std::unique_ptr<Tracker> tracker;
  RecordingResult result;
};

using TrackerMaker = std::function<std::unique_ptr<Tracker>()>;
using ObserverOfAttempt = std::function<FrameObserver(int attempt)>;

/// Tracks the recording; where the result is not confirmed, or an object's map fell apart, again from other
/// seeds (half way, a quarter, three quarters on) until one is: at most four times. The result that is_better
/// is kept (result_choice.h).
///
/// Before that the recording is tracked by masks that the results themselves give: of what moves, where a
/// static background stands behind it; of the larger of two objects, where the map is of the smaller; and of
/// the object that turns, where segmentation/body asks for it and the map is of another.
TrackedRecording track_until_confirmed(const Recording& recording, const TrackerMaker& make_tracker,
                                       const ObserverOfAttempt& observer_of);

}  // namespace mono_pose_tracker
