#include "pipeline/recording.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <future>
#include <optional>
#include <set>
#include <utility>

#include "doubtful_frames.h"
#include "finished_maps.h"
#include "recording_findings.h"
#include "recording_reader.h"
#include "unregistered_frames.h"

namespace mono_pose_tracker {

namespace {

// Reports stamps that do not increase: a trajectory must not have two poses at one time.
class StampCheck {
 public:
  void add(const SourceImage& image) {
    if (newest_ns_ && image.stamp_ns <= *newest_ns_ && count_++ == 0) first_ = image.name;
    newest_ns_ = std::max(newest_ns_.value_or(image.stamp_ns), image.stamp_ns);
  }

  void tell(std::vector<std::string>* warnings) const {
    if (count_ == 0) return;
    warnings->push_back(std::to_string(count_) +
                        " images have stamps that are not newer than those before (the first: " + first_ +
                        "): the images are used in their order; check the stamps of the recording");
  }

 private:
  std::optional<std::int64_t> newest_ns_;
  std::int64_t count_ = 0;
  std::string first_;
};

void add_stages(const FrameReport& report, RecordingResult* result) {
  for (const auto& [stage, ms] : report.stages) result->stage_ms[stage].push_back(ms);
}

// Reasons of frames without a pose: number of frames, and the text of the last one.
using Reasons = std::map<Reason, std::pair<int, std::string>>;

// The last text of the most frequent reason.
std::string usual_reason(const Reasons& reasons, std::int64_t frames_total) {
  const auto usual = std::max_element(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) {
    return a.second.first < b.second.first;
  });
  if (usual != reasons.end()) return usual->second.second;
  return frames_total == 0 ? "no image" : "one image makes no map: expected two at least";
}

bool has_folders(const std::map<std::int64_t, std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [](const auto& name) { return name.second.find('/') != std::string::npos; });
}

// Drops loaded maps in which no frame was registered.
void exclude_unseen_maps(RecordingResult* result) {
  std::vector<FinishedMap>& maps = result->maps;
  const auto is_loaded = [](const FinishedMap& map) { return map.is_loaded(); };
  const bool any_loaded = std::any_of(maps.begin(), maps.end(), is_loaded);
  maps.erase(std::remove_if(maps.begin(), maps.end(), [](const auto& map) { return map.trajectory.empty(); }),
             maps.end());
  if (any_loaded && !maps.empty() && std::none_of(maps.begin(), maps.end(), is_loaded)) {
    result->warnings.push_back(
        "no image was relocalised in the loaded map: the results have their own frame and unit");
  }
}

// Reads these images once more, in order.
void read_again(const Recording& recording, const std::set<std::int64_t>& frames, const Tracker& tracker,
                const RecordingResult& result, const std::function<void(const RecordingReader&)>& use) {
  if (frames.empty()) return;
  read_again(
      recording, result, tracker, [&](std::int64_t index) { return frames.count(index) > 0; }, use);
}

// Registers each image by itself. The finished map gives it a pose that is not doubtful, or it has none.
void register_images(const Recording& recording, const std::set<std::int64_t>& frames,
                     const FrameObserver& observer, Tracker* tracker, RecordingResult* result) {
  read_again(recording, frames, *tracker, *result, [&](const RecordingReader& reader) {
    const FrameReport report = tracker->register_image_again(reader.index(), reader.image().stamp_ns,
                                                             reader.prepared(), reader.mask());
    result->doubtful.erase(reader.index());
    observer(2, reader.index(), report);
  });
}

void unobserved(int, std::int64_t, const FrameReport&) {}

// Registers images from their neighbours and from each other, all held at once. Returns the number of
// registered ones.
std::size_t pose_together(const Recording& recording, const std::set<std::int64_t>& wanted,
                          const FrameObserver& observer, Tracker* tracker, RecordingResult* result) {
  std::map<std::int64_t, FrameReport> held;
  read_again(recording, wanted, *tracker, *result, [&](const RecordingReader& reader) {
    held[reader.index()] =
        tracker->keep_for_later(reader.index(), reader.image().stamp_ns, reader.prepared(), reader.mask());
  });
  tracker->fill_gaps();
  std::size_t registered = 0;
  for (const RegisteredFrame& frame : tracker->trajectory()) {
    const auto report = held.find(frame.index);
    if (report == held.end()) continue;
    ++registered;
    result->doubtful.erase(frame.index);
    report->second.map_from_camera = frame.map_from_camera;
    observer(2, frame.index, report->second);
  }
  return registered;
}

std::set<std::int64_t> without(const std::set<std::int64_t>& some, std::set<std::int64_t> frames) {
  for (const std::int64_t index : some) frames.erase(index);
  return frames;
}

// Registers the remaining images: first those nearest to a registered one, from which the map grows, then
// others while most of them get a pose. The rest, without the last group, is tried one by one.
void pose_the_rest(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                   RecordingResult* result) {
  std::set<std::int64_t> tried;
  while (!recording.interrupted()) {
    const std::set<std::int64_t> before = frames_of(tracker->trajectory());
    const std::set<std::int64_t> rest = frames_without_pose(before, result->frames_total);
    const std::set<std::int64_t> held =
        nearest_to_registered(without(tried, rest), before, recording.most_held);
    const std::size_t registered =
        held.empty() ? 0 : pose_together(recording, held, observer, tracker, result);
    if (held.size() == rest.size()) return;
    tried.insert(held.begin(), held.end());
    if (2 * registered > held.size()) continue;
    return register_images(recording, without(held, rest), observer, tracker, result);
  }
}

// Runs doubt_of on the present map in parallel with further work.
class ParallelDoubt {
 public:
  ParallelDoubt(const Recording& recording, const Map& map) {
    if (recording.threads <= 1 || !recording.doubt_of) return;
    // Without a thread it runs when its result is needed.
    found_ =
        std::async(std::launch::async | std::launch::deferred, [this, map, doubt_of = recording.doubt_of] {
          return doubt_of(map, [this] { return is_given_up_.load(); });
        });
  }
  ~ParallelDoubt() { is_given_up_ = true; }

  std::optional<std::string> take() {
    if (!found_.valid()) return std::nullopt;
    return found_.get();
  }

 private:
  std::atomic<bool> is_given_up_{false};
  std::future<std::string> found_;  // last: it waits for its thread, which uses the members above
};

void note(const FrameReport& report, const RecordingReader& reader, Reasons* reasons,
          RecordingResult* result) {
  if (report.reason == Reason::kImageSizeMismatch) {
    result->problems.push_back(reader.image().name + ": " + report.reason_text + ", skipped");
  }
  if (report.map_from_camera) ++result->frames_posed_live;
  result->frames_with_features += report.features > 0;
  if (report.reason == Reason::kDoubtfulPose) result->doubtful.insert(reader.index());
  if (report.reason != Reason::kOk && report.reason != Reason::kFirstFrame) {
    auto& [count, text] = (*reasons)[report.reason];
    ++count;
    text = report.reason_text;
  }
  add_stages(report, result);
}

void warn_of_masks(const Recording& recording, const RecordingReader& reader, RecordingResult* result) {
  if (!recording.masks) return;
  if (result->frames_total > 0 && reader.usable_masks() == 0) {
    result->warnings.push_back(
        "no image has a mask with unmasked pixels: check the masks of --masks and their names");
  }
  if (recording.masks->is_flat() && has_folders(result->names)) {
    result->warnings.push_back(
        "images of several folders have the same names, but --masks has no such subfolders: each mask is "
        "used for all images with its name");
  }
}

// Tracks all images in order, as from a live camera.
Reasons track_all(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                  RecordingResult* result) {
  Reasons reasons;
  StampCheck stamps;
  RecordingReader reader(
      recording, *tracker, [&](std::int64_t index) { return index >= recording.first_tracked; },
      &result->problems);
  while (reader.next()) {
    result->names[reader.index()] = reader.image().name;
    stamps.add(reader.image());
    ++result->frames_total;
    if (reader.index() < recording.first_tracked) {
      tracker->pass_over();
      ++result->frames_with_features;  // as far as is known
      continue;
    }
    const FrameReport report = tracker->process(reader.image().stamp_ns, reader.prepared(), reader.mask());
    note(report, reader, &reasons, result);
    observer(1, reader.index(), report);
  }
  result->unreadable = reader.unreadable();
  stamps.tell(&result->warnings);
  warn_of_masks(recording, reader, result);
  if (recording.interrupted()) {
    result->warnings.push_back("interrupted after " + std::to_string(result->frames_total) +
                               " images: later images are not in the result");
  }
  return reasons;
}

// Registers images in the finished map: those without a pose, and those whose pose is no longer valid.
void register_again(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                    RecordingResult* result) {
  recording.begin_stage(RecordingStage::kRegistering);
  pose_the_rest(recording, observer, tracker, result);
  // The following step removes poses to estimate them anew.
  if (recording.interrupted()) return;
  recording.begin_stage(RecordingStage::kRefining);
  std::set<std::int64_t> outdated = tracker->refine_with_graph();
  outdated.merge(tracker->adjust_frames());
  result->doubtful.insert(outdated.begin(), outdated.end());  // until they are registered again
  recording.begin_stage(RecordingStage::kRegistering);
  register_images(recording, outdated, unobserved, tracker, result);
}

// The maps of this recording and the findings about them.
void judge_maps(const Recording& recording, const Reasons& reasons, Tracker* tracker,
                RecordingResult* result) {
  ParallelDoubt doubt(recording, tracker->map());
  result->maps = tracker->maps();
  result->loops = tracker->loops();
  result->failed_adjustments = tracker->failed_adjustments();
  exclude_unseen_maps(result);
  exclude_covered_maps(&result->maps);
  if (result->maps.empty()) {
    result->tracked = false;
    result->reason = "no image was relocalised in the loaded map; the last: " +
                     usual_reason(reasons, result->frames_total);
    return;
  }
  // After an interruption not everything was tried.
  tracker->assess_maps(recording.interrupted() ? 0 : result->frames_with_features, &result->maps);
  result->trajectory = tracker->trajectory();
  add_findings(result);
  // Otherwise the recording may be tracked again.
  if (is_confirmed(*result)) result->doubt = doubt.take();
}

}  // namespace

RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker) {
  RecordingResult result;
  recording.begin_stage(RecordingStage::kTracking);
  const Reasons reasons = track_all(recording, observer, tracker, &result);
  recording.begin_stage(RecordingStage::kRefining);
  result.tracked = tracker->finish();
  result.rests_on_two_views = tracker->rests_on_two_views();
  if (!result.tracked) {
    result.reason = usual_reason(reasons, result.frames_total);
    return result;
  }
  const bool was_interrupted = recording.interrupted();
  register_again(recording, observer, tracker, &result);
  if (!was_interrupted && recording.interrupted()) {
    result.warnings.push_back("interrupted while images were registered again: some may have no pose");
  }
  recording.begin_stage(RecordingStage::kRefining);
  judge_maps(recording, reasons, tracker, &result);
  return result;
}

}  // namespace mono_pose_tracker
