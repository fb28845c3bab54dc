#include "mono_pose_tracker/tracking/recording.h"

#include <algorithm>
#include <optional>
#include <set>

namespace mono_pose_tracker {

namespace {

// The images of a recording with their masks; index counts those that could be read.
class Reader {
 public:
  Reader(const Recording& recording, std::vector<std::string>* problems)
      : recording_(recording), problems_(problems), source_(recording.open()) {}

  bool next() {
    while ((recording_.max_frames < 0 || index_ + 1 < recording_.max_frames) && !recording_.interrupted()) {
      image_ = source_->next();
      if (image_.kind == SourceImage::Kind::kEnd) return false;
      if (image_.kind == SourceImage::Kind::kSkipped) {
        if (problems_) problems_->push_back(image_.problem);
        continue;
      }
      ++index_;
      read_mask();
      return true;
    }
    return false;
  }

  std::int64_t index() const { return index_; }
  const SourceImage& image() const { return image_; }
  const cv::Mat& mask() const { return mask_; }
  std::int64_t usable_masks() const { return usable_masks_; }

 private:
  void read_mask() {
    mask_ = cv::Mat();
    if (!recording_.masks) return;
    std::string problem;
    mask_ = recording_.masks->mask_of(image_.mask_name, image_.image.size(), &problem);
    if (mask_.empty() && problems_) problems_->push_back(problem);
    if (mask_.empty() || cv::countNonZero(mask_) == 0) return;
    ++usable_masks_;
  }

  const Recording& recording_;
  std::vector<std::string>* problems_;
  std::unique_ptr<ImageSource> source_;
  SourceImage image_;
  cv::Mat mask_;
  std::int64_t index_ = -1;
  std::int64_t usable_masks_ = 0;
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

void warn_of_parts(RecordingResult* result) {
  if (result->maps.size() < 2) return;
  std::size_t apart = 0;
  for (std::size_t i = 1; i < result->maps.size(); ++i) apart += result->maps[i].trajectory.size();
  result->warnings.push_back(
      "the recording fell into " + std::to_string(result->maps.size()) +
      " maps that nothing ties together: " + std::to_string(apart) +
      " images are not in the first; each has a frame and a unit of its own (map_2, ...)");
}

// Features of so many images are held at once: half a gigabyte. What is beyond is posed image by image.
constexpr std::size_t kMaxHeld = 1000;

std::set<std::int64_t> posed_frames(const Tracker& tracker) {
  std::set<std::int64_t> posed;
  for (const PosedFrame& frame : tracker.trajectory()) posed.insert(frame.index);
  return posed;
}

void pose_the_rest(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                   RecordingResult* result) {
  std::set<std::int64_t> posed = posed_frames(*tracker);
  if (static_cast<std::int64_t>(posed.size()) == result->frames_total) return;
  Reader reader(recording, nullptr);
  std::map<std::int64_t, FrameReport> held;
  // A folder may have grown meanwhile: what the first pass did not see is left alone.
  while (reader.index() + 1 < result->frames_total && reader.next()) {
    if (posed.count(reader.index())) continue;
    const SourceImage& image = reader.image();
    if (held.size() < kMaxHeld) {
      held[reader.index()] =
          tracker->keep_for_later(reader.index(), image.stamp_ns, image.image, reader.mask());
    } else {
      observer(2, reader.index(),
               tracker->resect_again(reader.index(), image.stamp_ns, image.image, reader.mask()));
    }
  }
  tracker->fill_gaps();
  for (const PosedFrame& frame : tracker->trajectory()) {
    const auto report = held.find(frame.index);
    if (report == held.end()) continue;
    report->second.map_from_camera = frame.map_from_camera;
    observer(2, frame.index, report->second);
  }
}

}  // namespace

RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker) {
  RecordingResult result;
  std::map<Reason, std::pair<int, std::string>> reasons;
  StampCheck stamps;
  Reader reader(recording, &result.problems);
  while (reader.next()) {
    const FrameReport report = tracker->process(reader.image().stamp_ns, reader.image().image, reader.mask());
    result.names[reader.index()] = reader.image().name;
    stamps.add(reader.image());
    ++result.frames_total;
    if (report.reason == Reason::kImageSizeMismatch) {
      result.problems.push_back(reader.image().name + ": " + report.reason_text + ", skipped");
    }
    if (report.map_from_camera) ++result.frames_posed_live;
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
  result.maps = tracker->maps();
  result.trajectory = tracker->trajectory();
  warn_of_parts(&result);
  return result;
}

}  // namespace mono_pose_tracker
