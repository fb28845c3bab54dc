#include "pipeline/recording.h"

#include <algorithm>
#include <atomic>
#include <future>
#include <utility>

#include "recording_reader.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {

namespace {

bool has_folders(const std::map<std::int64_t, std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [](const auto& name) { return name.second.find('/') != std::string::npos; });
}

std::set<std::int64_t> without(const std::set<std::int64_t>& some, std::set<std::int64_t> frames) {
  for (const std::int64_t index : some) frames.erase(index);
  return frames;
}

// One run over a recording.
class RecordingRun {
 public:
  RecordingRun(const Recording& recording, const FrameObserver& observer, Tracker* tracker)
      : recording_(recording), observer_(observer), tracker_(tracker->impl()) {}

  RecordingResult run() {
    recording_.begin_stage(RecordingStage::kTracking);
    track_all();
    const bool was_interrupted = recording_.interrupted();
    recording_.begin_stage(RecordingStage::kRefining);
    result_.tracked = tracker_.finish();
    if (!result_.tracked) {
      result_.reason = usual_reason();
      return std::move(result_);
    }
    register_again();
    if (!was_interrupted && recording_.interrupted())
      warn("interrupted before all images were registered again: some may have no pose");
    recording_.begin_stage(RecordingStage::kRefining);
    judge_maps();
    return std::move(result_);
  }

 private:
  void warn(std::string text) { result_.warnings.push_back(std::move(text)); }

  // Tracks all images in order, as from a live camera.
  void track_all() {
    RecordingReader reader(
        recording_, tracker_, [&](std::int64_t index) { return index >= recording_.first_tracked; },
        &result_.problems);
    std::optional<std::int64_t> newest_ns;
    std::vector<std::string> stale;  // a trajectory must not have two poses at one time
    while (reader.next()) {
      const SourceImage& image = reader.image();
      result_.names[reader.index()] = image.name;
      if (newest_ns && image.stamp_ns <= *newest_ns) stale.push_back(image.name);
      newest_ns = std::max(newest_ns.value_or(image.stamp_ns), image.stamp_ns);
      ++result_.frames_total;
      if (reader.index() < recording_.first_tracked) {
        tracker_.pass_over();
        continue;
      }
      const FrameReport report = tracker_.process(image.stamp_ns, reader.prepared(), reader.mask());
      note(report, reader);
      observer_(1, reader.index(), report);
    }
    result_.unreadable = reader.unreadable();
    if (!stale.empty()) {
      warn(std::to_string(stale.size()) +
           " images have stamps that are not newer than those before (the first: " + stale.front() +
           "): the images are used in their order; check the stamps of the recording");
    }
    warn_of_masks(reader);
    if (recording_.interrupted()) {
      warn("interrupted after " + std::to_string(result_.frames_total) +
           " images: later images are not in the result");
    }
  }

  void note(const FrameReport& report, const RecordingReader& reader) {
    if (report.reason == Reason::kImageSizeMismatch) {
      result_.problems.push_back(reader.image().name + ": " + report.reason_text + ", skipped");
    }
    if (report.map_from_camera) ++result_.frames_posed_live;
    note_features(report, reader);
    if (report.reason == Reason::kDoubtfulPose) result_.doubtful.insert(reader.index());
    if (report.reason != Reason::kOk && report.reason != Reason::kFirstFrame) {
      auto& [count, text] = reasons_[report.reason];
      ++count;
      text = report.reason_text;
    }
    for (const auto& [stage, ms] : report.stages) result_.stage_ms[stage].push_back(ms);
  }

  void note_features(const FrameReport& report, const RecordingReader& reader) {
    if (report.features == 0) without_features_.insert(reader.index());
  }

  void warn_of_masks(const RecordingReader& reader) {
    if (!recording_.masks) return;
    if (result_.frames_total > 0 && reader.usable_masks() == 0)
      warn("no image has a mask with unmasked pixels: check the masks of --masks and their names");
    if (recording_.masks->is_flat() && has_folders(result_.names)) {
      warn(
          "images of several folders have the same names, but --masks has no such subfolders: each mask is "
          "used for all images with its name");
    }
  }

  // The last text of the most frequent reason.
  std::string usual_reason() const {
    const auto usual = std::max_element(reasons_.begin(), reasons_.end(), [](const auto& a, const auto& b) {
      return a.second.first < b.second.first;
    });
    if (usual != reasons_.end()) return usual->second.second;
    return result_.frames_total == 0 ? "no image" : "one image makes no map: expected two at least";
  }

  // Registers images in the finished map: those without a pose, and those whose pose is no longer valid.
  void register_again() {
    recording_.begin_stage(RecordingStage::kRegistering);
    register_rest();
    // The following step removes poses to estimate them anew.
    if (recording_.interrupted()) return;
    recording_.begin_stage(RecordingStage::kRefining);
    std::set<std::int64_t> outdated = tracker_.refine_with_graph();
    if (has_frame_without_neighbor(outdated)) {
      // Removed segments grow again from their borders.
      recording_.begin_stage(RecordingStage::kRegistering);
      register_together(
          nearest_to_registered(outdated, frames_of(tracker_.trajectory()), recording_.most_held));
      outdated = without(frames_of(tracker_.trajectory()), outdated);
      recording_.begin_stage(RecordingStage::kRefining);
      outdated.merge(tracker_.refine_with_graph());
    }
    outdated.merge(tracker_.adjust_frames(*tracker_.worker().latest()));
    result_.doubtful.insert(outdated.begin(), outdated.end());  // until they are registered again
    recording_.begin_stage(RecordingStage::kRegistering);
    register_each(outdated, [](int, std::int64_t, const FrameReport&) {});
    withdraw_unsupported(outdated);
  }

  // Whether the images before and after one of these have no pose either.
  bool has_frame_without_neighbor(const std::set<std::int64_t>& frames) const {
    const std::set<std::int64_t> registered = frames_of(tracker_.trajectory());
    return std::any_of(frames.begin(), frames.end(), [&](std::int64_t frame) {
      return registered.count(frame - 1) == 0 && registered.count(frame + 1) == 0;
    });
  }

  // Images that a wrong pose kept away may then find their place.
  void withdraw_unsupported(const std::set<std::int64_t>& removed) {
    std::set<std::int64_t> again = frames_of(tracker_.trajectory());
    again.insert(removed.begin(), removed.end());
    const std::set<std::int64_t> unsupported = tracker_.withdraw_unsupported();
    if (unsupported.empty()) return;
    const std::set<std::int64_t> outdated = tracker_.adjust_frames(*tracker_.worker().latest());
    again = without(unsupported, without(without(outdated, frames_of(tracker_.trajectory())), again));
    register_each(again, [](int, std::int64_t, const FrameReport&) {});
  }

  // Registers the remaining images: first those nearest to a registered one, from which the map grows, then
  // others while most of them get a pose. The rest, without the last group, is tried one by one.
  void register_rest() {
    std::set<std::int64_t> tried;
    while (!recording_.interrupted()) {
      const std::set<std::int64_t> before = frames_of(tracker_.trajectory());
      const std::set<std::int64_t> rest = frames_without_pose(before, result_.frames_total);
      const std::set<std::int64_t> held =
          nearest_to_registered(without(tried, rest), before, recording_.most_held);
      const std::size_t registered = held.empty() ? 0 : register_together(held);
      if (held.size() == rest.size()) return;
      tried.insert(held.begin(), held.end());
      if (2 * registered <= held.size()) return register_each(without(held, rest), observer_);
    }
  }

  // Registers images from their neighbours and from each other, all held at once. Returns the number of
  // registered ones.
  std::size_t register_together(const std::set<std::int64_t>& wanted) {
    std::map<std::int64_t, FrameReport> held;
    read_again(recording_, result_, tracker_, wanted, [&](const RecordingReader& reader) {
      FrameReport& report = held[reader.index()];
      report =
          tracker_.keep_for_later(reader.index(), reader.image().stamp_ns, reader.prepared(), reader.mask());
      if (reader.index() < recording_.first_tracked) note_features(report, reader);
    });
    tracker_.fill_gaps();
    std::size_t registered = 0;
    for (const RegisteredFrame& frame : tracker_.trajectory()) {
      const auto report = held.find(frame.index);
      if (report == held.end()) continue;
      ++registered;
      result_.doubtful.erase(frame.index);
      report->second.map_from_camera = frame.map_from_camera;
      observer_(2, frame.index, report->second);
    }
    return registered;
  }

  // Registers each image by itself. The finished map gives it a pose that is not doubtful, or it has none.
  void register_each(const std::set<std::int64_t>& frames, const FrameObserver& observer) {
    read_again(recording_, result_, tracker_, frames, [&](const RecordingReader& reader) {
      const FrameReport report = tracker_.register_image_again(reader.index(), reader.image().stamp_ns,
                                                               reader.prepared(), reader.mask());
      if (reader.index() < recording_.first_tracked) note_features(report, reader);
      result_.doubtful.erase(reader.index());
      observer(2, reader.index(), report);
    });
  }

  // The maps of this recording and the findings about them.
  void judge_maps() {
    std::atomic<bool> is_given_up{false};
    std::future<std::string> doubt;  // after the flag: its destructor waits for the thread
    if (recording_.threads > 1 && recording_.calibration_test) {
      // Without a thread it runs when its result is needed.
      doubt = std::async(
          std::launch::async | std::launch::deferred,
          [&, test = *recording_.calibration_test, map = tracker_.worker().mapper().map()]() mutable {
            test.options.cancel = [&] { return is_given_up || recording_.interrupted(); };
            return doubt_of_calibration(test.options, test.camera, map);
          });
    }
    result_.frames_with_features = result_.frames_total - static_cast<std::int64_t>(without_features_.size());
    result_.maps = tracker_.maps();
    result_.loops = tracker_.worker().mapper().loops();
    result_.failed_adjustments = tracker_.worker().mapper().failed_adjustments();
    exclude_unseen_maps();
    exclude_covered_maps(&result_.maps);
    if (result_.maps.empty()) {
      result_.tracked = false;
      result_.reason = "no image was relocalised in the loaded map; usual reason: " + usual_reason();
    } else {
      // After an interruption not everything was tried.
      tracker_.assess_maps(recording_.interrupted() ? 0 : result_.frames_with_features, &result_.maps);
      result_.trajectory = tracker_.trajectory();
      add_findings(&result_);
    }
    // Otherwise the recording may be tracked again.
    if (doubt.valid() && is_confirmed(result_)) result_.calibration_doubt = doubt.get();
    is_given_up = true;
  }

  // Drops loaded maps in which no frame was registered.
  void exclude_unseen_maps() {
    std::vector<FinishedMap>& maps = result_.maps;
    const auto is_loaded = [](const FinishedMap& map) { return map.is_loaded(); };
    const bool any_loaded = std::any_of(maps.begin(), maps.end(), is_loaded);
    maps.erase(
        std::remove_if(maps.begin(), maps.end(), [](const auto& map) { return map.trajectory.empty(); }),
        maps.end());
    if (any_loaded && !maps.empty() && std::none_of(maps.begin(), maps.end(), is_loaded))
      warn("no image was relocalised in the loaded map: the results have their own frame and unit");
  }

  const Recording& recording_;
  const FrameObserver& observer_;
  Tracker::Impl& tracker_;
  RecordingResult result_;
  std::set<std::int64_t> without_features_;  // as far as is known of images that were passed over
  std::map<Reason, std::pair<int, std::string>>
      reasons_;  // of frames without a pose: how many, the last text
};

}  // namespace

RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker) {
  return RecordingRun(recording, observer, tracker).run();
}

}  // namespace mono_pose_tracker
