#include "recording_page.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

namespace {

class ThumbnailSource : public ImageSource {
 public:
  ThumbnailSource(std::unique_ptr<ImageSource> source, std::shared_ptr<Thumbnails> thumbnails)
      : source_(std::move(source)), thumbnails_(std::move(thumbnails)) {}

  SourceImage next() override {
    SourceImage image = source_->next();
    if (image.kind == SourceImage::Kind::kImage) thumbnails_->add(index_++, image.image);
    return image;
  }

  bool skip() override {
    const bool passed = source_->skip();
    index_ += passed;
    return passed;
  }

  int size() const override { return source_->size(); }

 private:
  const std::unique_ptr<ImageSource> source_;
  const std::shared_ptr<Thumbnails> thumbnails_;
  std::int64_t index_ = 0;
};

/// How many landmarks of the map each keyframe observes, by the frame's index.
std::map<std::int64_t, int> observations_of_keyframes(const Map& map) {
  std::map<std::int64_t, int> counts;
  for (const auto& entry : map.keyframes()) {
    const std::vector<LandmarkId>& observed = entry.second.landmark_of_feature;
    counts[entry.second.frame_index] =
        static_cast<int>(observed.size() -
                         static_cast<std::size_t>(std::count(observed.begin(), observed.end(), kNoLandmark)));
  }
  return counts;
}

std::string title_of(const RecordingResult& result, const FinishedMap& map) {
  const bool is_first = &map == &result.maps.front();
  const bool confirmed = is_first ? is_confirmed(result) : map.confirmed();
  return std::to_string(map.trajectory.size()) + " of " + std::to_string(result.frames_total) +
         " images registered, " + std::to_string(map.snapshot->points.size()) + " points" +
         (confirmed ? "" : "; NOT confirmed: see report.json");
}

Eigen::Vector3d up_of(const std::vector<RegisteredFrame>& trajectory) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const RegisteredFrame& frame : trajectory)
    up -= frame.map_from_camera.rotation * Eigen::Vector3d::UnitY();
  return up.norm() > 0 ? up.normalized() : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
}

/// Adds the map's findings to the images that they name; those of a disqualifying finding are uncertain.
void add_findings(const QualityReport& quality, std::vector<SceneImage>* images) {
  for (const Finding& finding : quality.findings()) {
    for (const std::int64_t index : finding.images) {
      if (index < 0 || index >= static_cast<std::int64_t>(images->size())) continue;
      SceneImage& image = (*images)[static_cast<std::size_t>(index)];
      image.notes.push_back(finding.text);
      if (finding.is_disqualifying && image.map_from_camera) image.state = SceneImage::State::kUncertain;
    }
  }
}

}  // namespace

void Thumbnails::add(std::int64_t index, const cv::Mat& image) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (image.empty() || !jpegs_.emplace(index, std::vector<std::uint8_t>()).second) return;  // read again
  }
  const double scale =
      std::min(1.0, options_.max_side_px / static_cast<double>(std::max(image.cols, image.rows)));
  const cv::Size size(std::max(1, static_cast<int>(std::lround(scale * image.cols))),
                      std::max(1, static_cast<int>(std::lround(scale * image.rows))));
  cv::Mat small;
  cv::resize(image, small, size, 0, 0, cv::INTER_AREA);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", small, jpeg, {cv::IMWRITE_JPEG_QUALITY, options_.jpeg_quality});
  const std::lock_guard<std::mutex> lock(mutex_);
  jpegs_[index] = std::move(jpeg);
}

std::vector<std::uint8_t> Thumbnails::of(std::int64_t index) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = jpegs_.find(index);
  return found == jpegs_.end() ? std::vector<std::uint8_t>() : found->second;
}

std::unique_ptr<ImageSource> with_thumbnails(std::unique_ptr<ImageSource> source,
                                             std::shared_ptr<Thumbnails> thumbnails) {
  return std::make_unique<ThumbnailSource>(std::move(source), std::move(thumbnails));
}

void FrameNotes::add(std::int64_t index, const FrameReport& report) {
  Note& note = notes_[index];
  note.stamp_ns = report.stamp_ns;
  note.reason = report.reason == Reason::kOk ? "" : report.reason_text;
  if (report.map_from_camera) note.inliers = report.inliers;
}

std::optional<double> FrameNotes::time(std::int64_t index) const {
  const auto found = notes_.find(index);
  if (found == notes_.end()) return std::nullopt;
  return static_cast<double>(found->second.stamp_ns) * 1e-9;
}

int FrameNotes::inliers(std::int64_t index) const {
  const auto found = notes_.find(index);
  return found == notes_.end() ? -1 : found->second.inliers;
}

std::string FrameNotes::reason(std::int64_t index) const {
  const auto found = notes_.find(index);
  return found == notes_.end() ? "" : found->second.reason;
}

ScenePage recording_page(const RecordingResult& result, const FinishedMap& map,
                         const CameraParameters& camera, const FrameNotes& notes,
                         const Thumbnails& thumbnails) {
  ScenePage page;
  page.title = title_of(result, map);
  if (map.map.scale_source() != ScaleSource::kMapUnits) page.unit = "m";
  page.up = up_of(map.trajectory);
  page.tan_half_width = camera.width / (2 * camera.fx);
  page.tan_half_height = camera.height / (2 * camera.fy);
  page.points = map.snapshot->points;
  page.findings = result.warnings;
  for (const Finding& finding : map.quality.findings()) {
    if (std::find(page.findings.begin(), page.findings.end(), finding.text) == page.findings.end())
      page.findings.push_back(finding.text);
  }
  const std::map<std::int64_t, int> keyframes = observations_of_keyframes(map.map);
  const bool is_first = &map == &result.maps.front();
  page.images.resize(static_cast<std::size_t>(std::max<std::int64_t>(0, result.frames_total)));
  for (std::size_t i = 0; i < page.images.size(); ++i) {
    const auto name = result.names.find(static_cast<std::int64_t>(i));
    page.images[i].name = name == result.names.end() ? std::to_string(i) : name->second;
    page.images[i].state = SceneImage::State::kNotRegistered;
    page.images[i].time = notes.time(static_cast<std::int64_t>(i));
  }
  for (const RegisteredFrame& frame : map.trajectory) {
    if (frame.index < 0 || frame.index >= result.frames_total) continue;  // of an earlier run
    SceneImage& image = page.images[static_cast<std::size_t>(frame.index)];
    image.map_from_camera = frame.map_from_camera;
    image.time = static_cast<double>(frame.stamp_ns) * 1e-9;
    const auto keyframe = keyframes.find(frame.index);
    image.is_keyframe = keyframe != keyframes.end();
    image.inliers = image.is_keyframe ? keyframe->second : notes.inliers(frame.index);
    image.state = SceneImage::State::kRegistered;
    if (result.doubtful.count(frame.index) > 0) {
      image.state = SceneImage::State::kUncertain;
      const std::string reason = notes.reason(frame.index);
      image.notes.push_back(reason.empty() ? "its pose is uncertain (DOUBTFUL_POSE)" : reason);
    }
  }
  for (std::size_t i = 0; i < page.images.size(); ++i) {
    const auto index = static_cast<std::int64_t>(i);
    const std::string reason = notes.reason(index);
    if (!page.images[i].map_from_camera && !reason.empty()) page.images[i].notes.push_back(reason);
    if (is_first || page.images[i].map_from_camera) page.images[i].thumbnail = thumbnails.of(index);
  }
  add_findings(map.quality, &page.images);
  for (const ClosedLoop& loop : result.loops) page.loops.emplace_back(loop.from_frame, loop.to_frame);
  return page;
}

}  // namespace mono_pose_tracker
