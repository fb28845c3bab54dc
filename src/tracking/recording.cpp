#include "mono_pose_tracker/tracking/recording.h"

#include <algorithm>
#include <set>

namespace mono_pose_tracker {

namespace {

// The images of a recording with their masks; index counts those that could be read.
class Reader {
 public:
  Reader(const Recording& recording, std::vector<std::string>* problems)
      : recording_(recording), problems_(problems), source_(recording.open()) {}

  bool next() {
    while (recording_.max_frames < 0 || index_ + 1 < recording_.max_frames) {
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

 private:
  void read_mask() {
    mask_ = cv::Mat();
    if (!recording_.masks) return;
    std::string problem;
    mask_ = recording_.masks->mask_of(image_.name, image_.image.size(), &problem);
    if (mask_.empty() && problems_) problems_->push_back(problem);
  }

  const Recording& recording_;
  std::vector<std::string>* problems_;
  std::unique_ptr<ImageSource> source_;
  SourceImage image_;
  cv::Mat mask_;
  std::int64_t index_ = -1;
};

void add_stages(const FrameReport& report, RecordingResult* result) {
  for (const auto& [stage, ms] : report.stages) result->stage_ms[stage].push_back(ms);
}

// The last text of the reason that most frames had.
std::string usual_reason(const std::map<Reason, std::pair<int, std::string>>& reasons) {
  const auto usual = std::max_element(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) {
    return a.second.first < b.second.first;
  });
  return usual == reasons.end() ? "no image" : usual->second.second;
}

void pose_the_rest(const Recording& recording, const FrameObserver& observer, Tracker* tracker,
                   RecordingResult* result) {
  std::set<std::int64_t> posed;
  for (const PosedFrame& frame : tracker->trajectory()) posed.insert(frame.index);
  if (static_cast<std::int64_t>(posed.size()) == result->frames_total) return;
  Reader reader(recording, nullptr);
  // A folder may have grown meanwhile: what the first pass did not see is left alone.
  while (reader.index() + 1 < result->frames_total && reader.next()) {
    if (posed.count(reader.index())) continue;
    const FrameReport report =
        tracker->resect_again(reader.index(), reader.image().stamp_ns, reader.image().image, reader.mask());
    observer(2, report);
  }
}

}  // namespace

RecordingResult track_recording(const Recording& recording, const FrameObserver& observer, Tracker* tracker) {
  RecordingResult result;
  std::map<Reason, std::pair<int, std::string>> reasons;
  Reader reader(recording, &result.problems);
  while (reader.next()) {
    const FrameReport report = tracker->process(reader.image().stamp_ns, reader.image().image, reader.mask());
    result.names[reader.index()] = reader.image().name;
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
    observer(1, report);
  }
  result.tracked = tracker->finish();
  result.unconfirmed = tracker->is_unconfirmed();
  if (!result.tracked) {
    result.reason = usual_reason(reasons);
    return result;
  }
  pose_the_rest(recording, observer, tracker, &result);
  result.trajectory = tracker->trajectory();
  return result;
}

}  // namespace mono_pose_tracker
