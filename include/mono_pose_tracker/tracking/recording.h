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

#include "mono_pose_tracker/io/image_source.h"
#include "mono_pose_tracker/io/mask_folder.h"
#include "mono_pose_tracker/mapping/rigidity_check.h"
#include "mono_pose_tracker/tracking/tracker.h"

namespace mono_pose_tracker {

class BodyMasks;
class FeatureMemory;

/// A recording to be tracked: every image, in order, none dropped.
struct Recording {
  std::function<std::unique_ptr<ImageSource>()>
      open;  // from its beginning; called once more for images to be posed later
  const MaskFolder* masks = nullptr;
  std::shared_ptr<const BodyMasks> body;    // masks that an earlier attempt has found; null: none
  std::shared_ptr<FeatureMemory> features;  // what earlier attempts have found in the images; null: none
  std::int64_t max_frames = -1;             // all
  std::int64_t first_tracked = 0;           // images before it are posed in the end
  std::size_t most_held = 1000;             // images to be posed later, at once: half a gigabyte of features
  bool looks_closer = false;                // as Tracker::look_closer
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
  RigidityReport rigidity;                    // of the finished map
  std::vector<std::string> problems;          // one line for each image skipped or mask missing
  std::vector<std::string> warnings;          // what makes the result doubtful and what to do
  std::optional<std::string> doubt;           // what doubt_of says, where it was asked and the map is sure
  std::map<std::int64_t, std::string> names;  // of the images, by frame index
  std::vector<PosedFrame> trajectory;         // after the last optimisation, by index
  /// All that could not be joined and in which a frame is posed; the trajectory is the first's.
  std::vector<FinishedMap> maps;
  std::vector<ClosedLoop> loops;  // in any of the maps
  std::int64_t frames_posed_live = 0;
  std::set<std::int64_t> doubtful;  // frames of these: DOUBTFUL_POSE
  std::set<std::int64_t> left_out;  // of an end that hangs on too few points (Tracker::take_out_loose_ends)
  int failed_adjustments = 0;       // bundle adjustments that were thrown away
  std::map<std::string, std::vector<double>> stage_ms;
};

/// Called with the report of each frame as it comes; index counts the images that could be read, as in
/// RecordingResult. `pass` 2: posed against the finished map.
using FrameObserver = std::function<void(int pass, std::int64_t index, const FrameReport&)>;

/// Tracks the recording with inline mapping, until it ends or is interrupted, finishes the map and poses
/// against it the images that have no pose yet.
RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker);

/// Whether there is a map, it is of one rigid body, and nothing in it speaks against it
/// (FinishedMap::is_sure). It may hang together by little.
bool is_sure(const RecordingResult& result);

/// Whether there is a map that is sure, whose parts hold together, of whose path the images leave little open
/// (where that is asked: FinishedMap::is_path_known) and that is of what was asked for
/// (FinishedMap::confirmed), and that holds most of the images.
bool is_confirmed(const RecordingResult& result);

struct TrackedRecording {
  int attempt = 0;  // that gave it
  std::unique_ptr<Tracker> tracker;
  RecordingResult result;
};

using TrackerMaker = std::function<std::unique_ptr<Tracker>()>;
using ObserverOfAttempt = std::function<FrameObserver(int attempt)>;

/// Where the result is not sure, or an object's map fell apart, or the first map holds less than half of the
/// images (of a long recording: once), or a short recording's map fell apart or hangs together by little (not
/// if it was tracked by masks of what moves), the recording is tracked again, the map begun half way, a
/// quarter, three quarters on, where the body shows itself otherwise, until a result is enough. A result in
/// doubt gives way to one that is founded (FinishedMap::is_founded) and poses three quarters as many images,
/// or poses as many and less speaks against it; a sure one gives way to a founded one of more images, or of
/// as many where it hangs together by little; and one of less than half of the images to one of plainly more.
/// One map that is sure and hangs together by little is looked at closer (look_closer) before that.
///
/// Before that the recording is tracked by masks that the results themselves give: of what moves, where the
/// result is in doubt and a background stands still behind it (leave_out_background); of the larger of two
/// bodies, where the map is of the smaller (turn_to_larger_body; asked of the last result as well, if not of
/// an earlier one); and of the body that turns, where segmentation/body asks for it and the map is of another
/// (turn_to_other_body). In the end a short recording of whose images some have no pose is, if it was
/// not yet, tracked once or twice more with twice the features of each (look_closer).
TrackedRecording track_until_sure(const Recording& recording, const TrackerMaker& make_tracker,
                                  const ObserverOfAttempt& observer_of);

}  // namespace mono_pose_tracker
