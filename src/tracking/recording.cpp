#include "mono_pose_tracker/tracking/recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <utility>

#include "body_masks.h"
#include "finished_maps.h"
#include "mono_pose_tracker/common/prefetcher.h"

namespace mono_pose_tracker {

namespace {

// The next image of a recording with its mask, or the end.
struct Item {
  std::int64_t index = -1;  // counts the images that could be read
  SourceImage source;
  cv::Mat mask;
  bool is_mask_usable = false;
  std::vector<std::string> problems;  // since the item before
  PreparedImage prepared;
};

// The images of a recording, read and prepared ahead on threads - 1 threads.
class Reader {
 public:
  using IsWanted = std::function<bool(std::int64_t)>;  // by index: the others need not be prepared

  Reader(const Recording& recording, const Tracker& tracker, IsWanted is_wanted,
         std::vector<std::string>* problems)
      : recording_(recording),
        tracker_(tracker),
        is_wanted_(std::move(is_wanted)),
        problems_(problems),
        source_(recording.open()),
        items_([this](Item* item) { return read(item); }, [this](Item* item) { prepare(item); },
               std::max(recording.threads - 1, 0)) {}

  bool next() {
    item_ = Item();
    if (!items_.next(&item_)) return false;
    usable_masks_ += item_.is_mask_usable;
    if (problems_) problems_->insert(problems_->end(), item_.problems.begin(), item_.problems.end());
    return item_.source.kind == SourceImage::Kind::kImage;
  }

  std::int64_t index() const { return item_.index; }
  const SourceImage& image() const { return item_.source; }
  const PreparedImage& prepared() const { return item_.prepared; }
  const cv::Mat& mask() const { return item_.mask; }
  std::int64_t usable_masks() const { return usable_masks_; }

 private:
  // One thread at a time. The end is an item, too, for the problems before it.
  bool read(Item* item) {
    if (has_ended_) return false;
    while ((recording_.max_frames < 0 || read_ < recording_.max_frames) && !recording_.interrupted()) {
      item->source = source_->next();
      if (item->source.kind != SourceImage::Kind::kSkipped) break;
      item->problems.push_back(item->source.problem);
    }
    has_ended_ = item->source.kind != SourceImage::Kind::kImage;
    if (!has_ended_) item->index = read_++;
    return true;
  }

  void prepare(Item* item) const {
    if (item->index < 0) return;
    const SourceImage& source = item->source;
    if (recording_.masks) {
      std::string problem;
      item->mask = recording_.masks->mask_of(source.mask_name, source.image.size(), &problem);
      if (item->mask.empty()) item->problems.push_back(problem);
      item->is_mask_usable = !item->mask.empty() && cv::countNonZero(item->mask) > 0;
    }
    if (recording_.body && is_wanted_(item->index)) {
      const cv::Mat body = recording_.body->mask(item->index, source.image.size());
      item->mask = item->mask.empty() ? body : cv::Mat(item->mask & body);
    }
    if (recording_.threads > 1 && is_wanted_(item->index)) {
      item->prepared = tracker_.prepare(source.image, item->mask);
    } else {
      item->prepared.image = source.image;
    }
  }

  const Recording& recording_;
  const Tracker& tracker_;
  const IsWanted is_wanted_;
  std::vector<std::string>* problems_;
  std::unique_ptr<ImageSource> source_;
  std::int64_t read_ = 0;
  std::int64_t usable_masks_ = 0;
  bool has_ended_ = false;
  Item item_;
  Prefetcher<Item> items_;  // last: its threads use what stands before it
};

// Tells when the stamps do not grow: two poses of one time are one too many for whoever reads the trajectory.
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

// The last text of the reason that most frames had.
std::string usual_reason(const std::map<Reason, std::pair<int, std::string>>& reasons,
                         std::int64_t frames_total) {
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

void warn_of_seams(RecordingResult* result) {
  for (const FinishedMap& map : result->maps) {
    if (map.seam.holds() || result->unconfirmed) continue;
    if (map.seam.frame_index < 0) {
      result->warnings.push_back("a part of the loaded map is held to the rest by " +
                                 std::to_string(map.seam.points) +
                                 " points only: its size and place may be wrong");
      continue;
    }
    result->warnings.push_back("images from number " + std::to_string(map.seam.frame_index) +
                               " on are held to those before by " + std::to_string(map.seam.points) +
                               " points only: their size and place beside these may be wrong; more overlap "
                               "between the views would tell");
  }
}

void warn_of_depth(RecordingResult* result) {
  if (result->maps.front().is_depth_sure()) return;
  result->warnings.push_back(
      "seen from so far away, the depths could as well be reversed and the turns the other way round: turn "
      "farther, come nearer, or give masks of what moves as one (--masks)");
}

// Frames of earlier runs come before 0.
std::string place_text(std::int64_t frame_index) {
  return frame_index < 0 ? "in the loaded map" : "at image number " + std::to_string(frame_index);
}

void warn_of_contradictions(RecordingResult* result) {
  const Contradiction& worst = result->maps.front().contradiction;
  if (!worst.is_one()) return;
  result->warnings.push_back(
      place_text(worst.frame_index) + " " + std::to_string(worst.contradicting) + " of " +
      std::to_string(worst.matches) +
      " points are seen elsewhere than the map has them: more than one thing moves, or the map is wrong from "
      "there on; give masks of what moves as one (--masks), or record it again with more overlap");
}

void warn_of_torn_tracks(RecordingResult* result) {
  const TornTracks& worst = result->maps.front().torn_tracks;
  if (!worst.is_one()) return;
  result->warnings.push_back(
      place_text(worst.frame_index) + " " + std::to_string(worst.torn) + " of " +
      std::to_string(worst.matches) +
      " points have two places in the map, as no one place agrees with all that is seen of them: the map may "
      "be wrong about there; give masks of what moves as one (--masks), or record it again with more "
      "overlap");
}

// Two bodies, of which a map can be of one only.
void warn_of_other_body(RecordingResult* result) {
  const FinishedMap& map = result->maps.front();
  const long percent = std::lround(100 * map.other_body.share());
  if (map.is_of_other_body) {
    result->warnings.push_back(
        "two bodies move, each as one, and the map's is not plainly the one that turns, as segmentation/body "
        "asks: " +
        std::to_string(percent) +
        " % of the points move with another that turns as far or farther; give masks of the one that is "
        "wanted (--masks)");
  } else if (map.other_body.is_comparable()) {
    result->warnings.push_back(
        "two bodies move, each as one: the map is of the larger, and " + std::to_string(percent) +
        " % of the points, which move otherwise, are left out; where the other is wanted, give masks of it "
        "(--masks), or segmentation/body: turning for one that turns (config/object.yaml)");
  }
}

void warn_of_parts(RecordingResult* result) {
  if (result->maps.size() < 2) return;
  const std::size_t apart = frames_beside_first(result->maps);
  result->warnings.push_back(
      "the recording fell into " + std::to_string(result->maps.size()) +
      " maps that nothing ties together: " + std::to_string(apart) +
      " images are not in the first; each has a frame and a unit of its own (map_2, ...)");
}

// What is not posed is easily overlooked in a trajectory.
void warn_of_unposed(RecordingResult* result) {
  constexpr double kMostShare = 0.1;  // fewer are the few blurred ones that every recording has
  std::set<std::int64_t> posed;
  for (const FinishedMap& map : result->maps) posed.merge(frames_of(map.trajectory));
  std::int64_t unposed = 0, run = 0, longest = 0, last = -1;
  for (const auto& name : result->names) {
    const bool has_none = posed.count(name.first) == 0;
    unposed += has_none;
    run = has_none ? run + 1 : 0;
    if (run > longest) longest = run, last = name.first;
  }
  if (static_cast<double>(unposed) <= kMostShare * static_cast<double>(result->frames_total)) return;
  result->warnings.push_back(std::to_string(unposed) + " of " + std::to_string(result->frames_total) +
                             " images have no pose, most in a row from number " +
                             std::to_string(last - longest + 1) + " to " + std::to_string(last) +
                             ": dark, blurred, or too little overlap with the others");
}

// Maps from a file in which no frame was found are none of this recording's.
void leave_out_unseen_maps(RecordingResult* result) {
  std::vector<FinishedMap>& maps = result->maps;
  const bool any_loaded = std::any_of(maps.begin(), maps.end(), is_loaded);
  maps.erase(std::remove_if(maps.begin(), maps.end(), [](const auto& map) { return map.trajectory.empty(); }),
             maps.end());
  if (any_loaded && !maps.empty() && std::none_of(maps.begin(), maps.end(), is_loaded)) {
    result->warnings.push_back(
        "no image was found in the loaded map: what there is has a frame and a unit of its own");
  }
}

// Features of so many images are held at once: half a gigabyte. What is beyond is posed image by image.
constexpr std::size_t kMaxHeld = 1000;

// Whether the finished map, the largest of them, is of one rigid body.
void check_map(int image_width, RecordingResult* result) {
  result->rigidity = check_rigidity(result->maps.front().map, image_width);
  if (result->rigidity.is_rigid) return;
  char text[320];
  std::snprintf(text, sizeof text,
                "more than one motion is in the map: %s and on, the poses that its %s landmarks give "
                "are %.1f px apart; give masks of the object (--masks), or config/object.yaml",
                place_text(result->rigidity.frame_index).c_str(), result->rigidity.parts.c_str(),
                result->rigidity.disagreement_px);
  result->warnings.push_back(text);
}

// The images that are wanted once more, in order.
void read_again(const Recording& recording, std::int64_t frames_total, const Tracker& tracker,
                const Reader::IsWanted& is_wanted, const std::function<void(const Reader&)>& use) {
  Reader reader(recording, tracker, is_wanted, nullptr);
  // A folder may have grown meanwhile: what the first pass did not see is left alone.
  while (reader.index() + 1 < frames_total && reader.next()) {
    if (is_wanted(reader.index())) use(reader);
  }
}

FrameReport resect_again(const Reader& reader, Tracker* tracker) {
  return tracker->resect_again(reader.index(), reader.image().stamp_ns, reader.prepared(), reader.mask());
}

void pose_the_rest(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                   RecordingResult* result) {
  const std::set<std::int64_t> posed = frames_of(tracker->trajectory());
  if (static_cast<std::int64_t>(posed.size()) == result->frames_total) return;
  const auto is_wanted = [&](std::int64_t index) { return posed.count(index) == 0; };
  std::map<std::int64_t, FrameReport> held;
  read_again(recording, result->frames_total, *tracker, is_wanted, [&](const Reader& reader) {
    if (held.size() < kMaxHeld) {
      held[reader.index()] =
          tracker->keep_for_later(reader.index(), reader.image().stamp_ns, reader.prepared(), reader.mask());
    } else {
      observer(2, reader.index(), resect_again(reader, tracker));
    }
  });
  tracker->fill_gaps();
  for (const PosedFrame& frame : tracker->trajectory()) {
    const auto report = held.find(frame.index);
    if (report == held.end()) continue;
    report->second.map_from_camera = frame.map_from_camera;
    observer(2, frame.index, report->second);
  }
}

// Of the images that are no keyframes the poses were found while the map was another.
void pose_again(const Recording& recording, std::int64_t frames_total, Tracker* tracker) {
  const std::set<std::int64_t> before = tracker->posed_before_remake();
  if (before.empty()) return;
  const auto is_wanted = [&](std::int64_t index) { return before.count(index) > 0; };
  read_again(recording, frames_total, *tracker, is_wanted,
             [&](const Reader& reader) { resect_again(reader, tracker); });
}

// Poses where the camera can hardly have been, between images where it certainly was.
void pose_strays(const Recording& recording, std::int64_t frames_total, Tracker* tracker) {
  const std::set<std::int64_t> strays = tracker->take_out_strays();
  if (strays.empty()) return;
  const auto is_stray = [&](std::int64_t index) { return strays.count(index) > 0; };
  read_again(recording, frames_total, *tracker, is_stray,
             [&](const Reader& reader) { resect_again(reader, tracker); });
  tracker->leave_out_strays();
}

}  // namespace

bool is_sure(const RecordingResult& result) {
  return !result.tracked || (result.rigidity.is_rigid && result.maps.front().is_sure());
}

bool is_confirmed(const RecordingResult& result) {
  return result.tracked && result.rigidity.is_rigid && result.maps.front().confirmed;
}

namespace {

// An object that is lost while it turns is often found again from another beginning; its recordings are
// short.
bool fell_apart(const RecordingResult& result) {
  return result.tracked && result.maps.size() > 1 && is_narrow(result.maps.front().map);
}

bool is_enough(const RecordingResult& result) { return is_sure(result) && !fell_apart(result); }

// What takes the place of another must be better founded, or as well and longer. A sure piece of the
// recording is no better answer than most of it with a warning.
bool is_most_of(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMinShare = 0.75;
  return static_cast<double>(result.trajectory.size()) >=
         kMinShare * static_cast<double>(before.trajectory.size());
}

bool is_better(const RecordingResult& result, const RecordingResult& before) {
  if (!is_confirmed(result)) return false;
  return is_sure(before) ? result.trajectory.size() > before.trajectory.size() : is_most_of(result, before);
}

// Counts them.
class Attempts {
 public:
  Attempts(const TrackerMaker& make_tracker, const ObserverOfAttempt& observer_of)
      : make_tracker_(make_tracker), observer_of_(observer_of) {}

  TrackedRecording next(const Recording& recording) {
    TrackedRecording made;
    made.attempt = count_++;
    made.tracker = make_tracker_();
    made.result = track_recording(recording, observer_of_(made.attempt), made.tracker.get());
    return made;
  }

 private:
  const TrackerMaker& make_tracker_;
  const ObserverOfAttempt& observer_of_;
  int count_ = 0;
};

bool is_of_other_body(const RecordingResult& result) {
  return result.tracked && result.maps.front().is_of_other_body;
}

// Where the map is of a body that turns less than another: the recording again, by masks of all that moves
// otherwise than the map, until the map is of what turns most. It is kept, with the masks, where it plainly
// turns farther than the first, and most of the images show it: of three bodies it may be two at once.
void turn_to_other_body(Attempts* attempts, Recording* recording, TrackedRecording* kept) {
  constexpr int kMostBodies = 3;  // a head, the shoulders below it, the room behind
  Recording masked = *recording;
  TrackedRecording found;
  const RecordingResult* result = &kept->result;
  for (int bodies = 1; bodies < kMostBodies && is_of_other_body(*result); ++bodies) {
    masked.body = std::make_shared<BodyMasks>(result->maps.front().other_body.tracks, masked.body);
    if (masked.body->are_empty() || masked.interrupted()) return;
    found = attempts->next(masked);
    result = &found.result;
    if (!result->tracked) return;
  }
  if (!is_most_of(*result, kept->result)) return;
  const double turn = turn_before_cameras(result->maps.front().map);
  if (turn < OtherBody::kPlainly * turn_before_cameras(kept->result.maps.front().map)) return;
  *recording = std::move(masked);
  *kept = std::move(found);
}

}  // namespace

TrackedRecording track_until_sure(const Recording& recording, const TrackerMaker& make_tracker,
                                  const ObserverOfAttempt& observer_of) {
  constexpr std::array<double, 3> kOtherBeginnings = {0.5, 0.25, 0.75};  // as far from one another as can be
  Attempts attempts(make_tracker, observer_of);
  TrackedRecording kept = attempts.next(recording);
  if (!recording.try_again) return kept;
  Recording again = recording;
  if (is_of_other_body(kept.result)) turn_to_other_body(&attempts, &again, &kept);
  for (const double beginning : kOtherBeginnings) {
    if (is_enough(kept.result) || recording.interrupted()) break;
    again.first_tracked =
        static_cast<std::int64_t>(beginning * static_cast<double>(kept.result.frames_total));
    TrackedRecording next = attempts.next(again);
    if (is_better(next.result, kept.result)) kept = std::move(next);
  }
  return kept;
}

RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker) {
  RecordingResult result;
  std::map<Reason, std::pair<int, std::string>> reasons;
  StampCheck stamps;
  Reader reader(
      recording, *tracker, [&](std::int64_t index) { return index >= recording.first_tracked; },
      &result.problems);
  int image_width = 0;
  while (reader.next()) {
    image_width = reader.image().image.cols;
    result.names[reader.index()] = reader.image().name;
    stamps.add(reader.image());
    ++result.frames_total;
    if (reader.index() < recording.first_tracked) {
      tracker->pass_over();
      continue;
    }
    const FrameReport report = tracker->process(reader.image().stamp_ns, reader.prepared(), reader.mask());
    if (report.reason == Reason::kImageSizeMismatch) {
      result.problems.push_back(reader.image().name + ": " + report.reason_text + ", skipped");
    }
    if (report.map_from_camera) ++result.frames_posed_live;
    if (report.reason == Reason::kDoubtfulPose) ++result.frames_doubtful;
    if (report.reason != Reason::kOk && report.reason != Reason::kFirstFrame) {
      auto& [count, text] = reasons[report.reason];
      ++count;
      text = report.reason_text;
    }
    add_stages(report, &result);
    observer(1, reader.index(), report);
  }
  stamps.tell(&result.warnings);
  if (recording.masks && result.frames_total > 0 && reader.usable_masks() == 0) {
    result.warnings.push_back(
        "not one image has a mask that leaves anything of it: check --masks and its names");
  }
  if (recording.masks && recording.masks->is_flat() && has_folders(result.names)) {
    result.warnings.push_back(
        "images of several folders have the same names, and --masks holds no such folders: "
        "each mask is used for all images of its name");
  }
  if (recording.interrupted()) {
    result.warnings.push_back("interrupted after " + std::to_string(result.frames_total) +
                              " images: what follows is not in the result");
  }
  result.tracked = tracker->finish();
  result.unconfirmed = tracker->is_unconfirmed();
  if (!result.tracked) {
    result.reason = usual_reason(reasons, result.frames_total);
    return result;
  }
  pose_the_rest(recording, observer, tracker, &result);
  pose_again(recording, result.frames_total, tracker);
  pose_strays(recording, result.frames_total, tracker);
  result.maps = tracker->maps();
  result.loops = tracker->loops();
  result.failed_adjustments = tracker->failed_adjustments();
  leave_out_unseen_maps(&result);
  leave_out_covered_maps(&result.maps);
  if (result.maps.empty()) {
    result.tracked = false;
    result.reason =
        "no image was found in the loaded map; the last: " + usual_reason(reasons, result.frames_total);
    return result;
  }
  check_map(image_width, &result);
  result.trajectory = tracker->trajectory();
  warn_of_parts(&result);
  warn_of_unposed(&result);
  warn_of_seams(&result);
  warn_of_depth(&result);
  warn_of_contradictions(&result);
  warn_of_torn_tracks(&result);
  warn_of_other_body(&result);
  return result;
}

}  // namespace mono_pose_tracker
