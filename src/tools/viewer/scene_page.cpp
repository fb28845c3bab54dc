#include "scene_page.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "../json.h"
#include "common/text.h"
#include "io/files.h"
#include "io/stamp.h"

namespace mono_pose_tracker {
namespace {

std::string base64(const std::uint8_t* bytes, std::size_t size) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((size + 2) / 3 * 4);
  for (std::size_t i = 0; i < size; i += 3) {
    const std::size_t count = std::min<std::size_t>(3, size - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) {
      text.push_back(k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=');
    }
  }
  return text;
}

// Browsers are little-endian, as WebGL's arrays are the machine's.
void append_little_endian(float value, std::vector<std::uint8_t>* bytes) {
  std::uint32_t bits = 0;
  static_assert(sizeof bits == sizeof value);
  std::copy_n(reinterpret_cast<const char*>(&value), sizeof bits, reinterpret_cast<char*>(&bits));
  for (int shift = 0; shift < 32; shift += 8) bytes->push_back(static_cast<std::uint8_t>(bits >> shift));
}

Json json_of(const Eigen::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

/// All positions are drawn relative to it: 32 bits hold them then.
Eigen::Vector3d origin_of(const ScenePage& page) {
  for (const SceneImage& image : page.images) {
    if (image.map_from_camera) return image.map_from_camera->translation;
  }
  return Eigen::Vector3d::Zero();
}

void add_points(const ScenePage& page, const ScenePageOptions& options, const Eigen::Vector3d& origin,
                Json* json) {
  const std::size_t step = (page.points.size() + options.max_points - 1) / options.max_points;
  std::vector<std::uint8_t> xyz, rgb;
  for (std::size_t i = 0; i < page.points.size(); i += std::max<std::size_t>(1, step)) {
    const ColoredPoint& point = page.points[i];
    if (!point.x_in_map.allFinite()) continue;
    for (int axis = 0; axis < 3; ++axis) {
      append_little_endian(static_cast<float>(point.x_in_map[axis] - origin[axis]), &xyz);
    }
    rgb.insert(rgb.end(), {point.r, point.g, point.b});
  }
  (*json)["xyz"] = base64(xyz.data(), xyz.size());
  (*json)["rgb"] = base64(rgb.data(), rgb.size());
}

/// Every so many images keep their thumbnails.
std::size_t thumbnail_step(const ScenePage& page, const ScenePageOptions& options) {
  std::size_t bytes = 0;
  for (const SceneImage& image : page.images) bytes += image.thumbnail.size();
  return 1 + bytes / std::max<std::size_t>(1, options.max_thumbnail_bytes);
}

Json json_of(const SceneImage& image, bool with_thumbnail) {
  Json json = {{"n", image.name}};
  if (image.time) json["t"] = *image.time;
  if (image.map_from_camera) {
    const Eigen::Vector3d& x = image.map_from_camera->translation;
    const Eigen::Quaterniond& q = image.map_from_camera->rotation;
    json["p"] = {x.x(), x.y(), x.z(), q.x(), q.y(), q.z(), q.w()};
  }
  if (image.state != SceneImage::State::kRegistered) json["s"] = static_cast<int>(image.state);
  if (image.is_keyframe) json["k"] = 1;
  if (image.inliers >= 0) json["i"] = image.inliers;
  if (image.error) json["e"] = *image.error;
  if (!image.notes.empty()) json["f"] = image.notes;
  if (with_thumbnail && !image.thumbnail.empty()) {
    json["j"] = base64(image.thumbnail.data(), image.thumbnail.size());
  }
  return json;
}

Json to_json(const ScenePage& page, const ScenePageOptions& options) {
  const Eigen::Vector3d origin = origin_of(page);
  Json json = {{"title", page.title},
               {"unit", page.unit},
               {"up", json_of(page.up)},
               {"origin", json_of(origin)},
               {"frustum", {page.tan_half_width, page.tan_half_height}},
               {"findings", page.findings},
               {"worst", page.worst_error}};
  add_points(page, options, origin, &json);
  const std::size_t step = thumbnail_step(page, options);
  Json images = Json::array(), loops = Json::array(), reference = Json::array();
  for (std::size_t i = 0; i < page.images.size(); ++i) {
    images.push_back(json_of(page.images[i], i % step == 0));
  }
  for (const auto& [from, to] : page.loops) loops.push_back({from, to});
  for (const Eigen::Vector3d& x : page.reference) reference.push_back(json_of(x));
  json["images"] = std::move(images);
  json["loops"] = std::move(loops);
  json["reference"] = std::move(reference);
  return json;
}

/// Within a script element only "<" can end it.
std::string script_text(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size());
  for (char c : text) {
    if (c == '<') {
      escaped += "\\u003c";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace

void write_scene_page(const std::string& path, const ScenePage& page, const ScenePageOptions& options) {
  constexpr std::string_view kPlace = "@SCENE@";
  const std::string_view text(kScenePageText);
  const std::size_t at = text.find(kPlace);
  const std::string scene = script_text(to_json(page, options));
  write_file_atomically(path, [&](std::ostream& out) {
    out << text.substr(0, at) << scene << text.substr(at + kPlace.size());
  });
}

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
    if (map.doubtful.count(frame.index) > 0) image.state = SceneImage::State::kUncertain;
    if (result.doubtful.count(frame.index) > 0) {
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

namespace {

using Matches = std::vector<MatchedPosition>;

Matches sorted_by_x(Matches matches) {
  std::sort(matches.begin(), matches.end(), [](const MatchedPosition& a, const MatchedPosition& b) {
    return a.estimate.x() < b.estimate.x();
  });
  return matches;
}

/// The match of a pose; its position is equal after the alignment. Null: none.
const MatchedPosition* match_of(const Matches& by_x, const Eigen::Vector3d& aligned) {
  const MatchedPosition* nearest = nullptr;
  double least = 1e-9 * (1 + aligned.norm());
  const double end = aligned.x() + least;
  auto match =
      std::lower_bound(by_x.begin(), by_x.end(), aligned.x() - least,
                       [](const MatchedPosition& candidate, double x) { return candidate.estimate.x() < x; });
  for (; match != by_x.end() && match->estimate.x() <= end; ++match) {
    const double distance = (match->estimate - aligned).norm();
    if (distance < least) least = distance, nearest = &*match;
  }
  return nearest;
}

void add_path(const EvaluatedPath& path, ScenePage* page) {
  const Sim3& s = path.error.reference_from_estimate;
  const Matches matches = sorted_by_x(path.error.positions);
  for (const StampedPose& pose : path.poses) {
    SceneImage image;
    image.name = format_stamp(pose.stamp_ns);
    image.time = static_cast<double>(pose.stamp_ns) * 1e-9;
    image.map_from_camera = Rigid3((s.rotation * pose.map_from_camera.rotation).normalized(),
                                   s * pose.map_from_camera.translation);
    const MatchedPosition* const match = match_of(matches, image.map_from_camera->translation);
    if (match) {
      image.error = (match->estimate - match->reference).norm();
      image.notes.push_back(formatted("rotation is off by %.2f degrees", match->rotation_deg));
      page->worst_error = std::max(page->worst_error, *image.error);
    } else {
      image.notes.push_back("no reference pose near in time");
    }
    page->images.push_back(std::move(image));
  }
}

}  // namespace

ScenePage evaluation_page(const std::vector<StampedPose>& reference,
                          const std::vector<EvaluatedPath>& paths) {
  ScenePage page;
  page.unit = "reference units";
  page.worst_error = 1e-12;  // coloured by error also where there is none
  std::size_t matched = 0;
  for (const EvaluatedPath& path : paths) {
    // The images of another map follow a gap.
    if (!page.images.empty()) {
      SceneImage gap;
      gap.name = "another map begins";
      gap.state = SceneImage::State::kNotRegistered;
      page.images.push_back(gap);
    }
    add_path(path, &page);
    matched += static_cast<std::size_t>(path.error.frames_matched);
  }
  if (!paths.empty()) {
    page.up = -(paths.front().error.reference_from_view.rotation * Eigen::Vector3d::UnitY());
    page.title = formatted("%zu poses compared: position RMSE %.4g, median %.4g, max %.4g", matched,
                           paths.front().error.position_rmse, paths.front().error.position_median,
                           paths.front().error.position_max);
  }
  for (const StampedPose& pose : reference) page.reference.push_back(pose.map_from_camera.translation);
  return page;
}

}  // namespace mono_pose_tracker
