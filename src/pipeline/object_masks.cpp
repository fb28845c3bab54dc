#include "object_masks.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/statistics.h"
#include "mapping/keyframe_landmarks.h"

namespace mono_pose_tracker {

namespace {

constexpr ObjectMasksOptions kObjectMasks{};
constexpr ObjectOutlinesOptions kOutlines{};

std::vector<MotionTrack> outvoted(const std::vector<MotionTrack>& tracks) {
  std::vector<MotionTrack> smooth = tracks;
  for (MotionTrack& track : smooth) {
    DistantVotes near;
    for (const MotionTrack& t : tracks) near.emplace_back((t.from - track.from).squaredNorm(), t.is_other);
    track.is_other = most_of_nearest(kObjectMasks.voters, std::move(near));
  }
  return smooth;
}

// Landmarks of the nearest keyframes.
std::vector<LandmarkId> landmarks_near(const Map& map, const Eigen::Vector3d& center_in_map) {
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& entry : map.keyframes()) {
    near.emplace_back((entry.second.center_in_map() - center_in_map).norm(), entry.first);
  }
  const auto last =
      near.begin() + static_cast<std::ptrdiff_t>(std::min(kOutlines.nearest_keyframes, near.size()));
  std::partial_sort(near.begin(), last, near.end());
  std::vector<KeyframeId> nearest;
  for (auto k = near.begin(); k != last; ++k) nearest.push_back(k->second);
  return landmarks_observed_by(map, nearest);
}

}  // namespace

ObjectMasks::ObjectMasks(const std::vector<MotionTrack>& tracks, std::shared_ptr<const ObjectMasks> within)
    : within_(std::move(within)) {
  for (const MotionTrack& track : tracks) spans_[track.from_index].push_back(track);
  for (auto span = spans_.begin(); span != spans_.end();) {
    span->second = outvoted(span->second);
    const auto others = std::count_if(span->second.begin(), span->second.end(),
                                      [](const MotionTrack& track) { return track.is_other; });
    span = others >= kObjectMasks.min_features ? std::next(span) : spans_.erase(span);
  }
}

bool ObjectMasks::show(std::int64_t index) const {
  const auto span = spans_.upper_bound(index);
  if (span == spans_.begin()) return false;
  const std::vector<MotionTrack>& tracks = std::prev(span)->second;
  return std::any_of(tracks.begin(), tracks.end(),
                     [&](const MotionTrack& track) { return index <= track.to_index; });
}

ObjectPoints ObjectMasks::at(std::int64_t index) const {
  auto span = spans_.upper_bound(index);
  if (span != spans_.begin()) --span;
  ObjectPoints objects;
  for (const MotionTrack& track : span->second) {
    const auto frames = static_cast<float>(track.to_index - track.from_index);
    const float on = std::clamp(static_cast<float>(index - track.from_index) / frames, 0.0F, 1.0F);
    const Eigen::Vector2f pixel = (1 - on) * track.from + on * track.to;
    (track.is_other ? objects.other : objects.object).emplace_back(pixel.x(), pixel.y());
  }
  return objects;
}

cv::Mat ObjectMasks::mask(std::int64_t index, const cv::Size& size) const {
  const ObjectPoints objects = at(index);
  const cv::Mat1f from_other = distances_from(objects.other, size);
  cv::Mat mask = from_other <= reach_of(objects.other);
  mask &= from_other < distances_from(objects.object, size);
  if (within_) mask &= within_->mask(index, size);
  return mask;
}

ObjectOutlines::ObjectOutlines(const RecordingResult& result, const CameraModel& camera)
    : map_(result.maps.front().map), camera_(camera) {
  for (const RegisteredFrame& frame : result.trajectory) {
    camera_from_map_[frame.index] = frame.map_from_camera.inverse();
  }
  // Frames of a loaded map are of another recording.
  std::vector<MotionTrack> here;
  const std::vector<MotionTrack>& object_tracks = result.maps.front().object_tracks;
  std::copy_if(object_tracks.begin(), object_tracks.end(), std::back_inserter(here),
               [](const MotionTrack& track) { return track.from_index >= 0; });
  auto others = std::make_shared<const ObjectMasks>(here, nullptr);
  const auto shown = std::count_if(camera_from_map_.begin(), camera_from_map_.end(),
                                   [&](const auto& frame) { return others->show(frame.first); });
  if (2 * shown >= static_cast<std::ptrdiff_t>(camera_from_map_.size())) others_ = std::move(others);
}

cv::Mat ObjectOutlines::outlined(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& mask) const {
  const auto pose = camera_from_map_.find(frame_index);
  if (pose == camera_from_map_.end()) return mask;
  ObjectPoints points;
  for (const LandmarkId l : landmarks_near(map_, pose->second.inverse().translation)) {
    Eigen::Vector2d pixel;
    if (!camera_.project(pose->second * map_.landmark(l)->x_in_map, &pixel)) continue;
    points.object.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  if (others_ && others_->show(frame_index)) points.other = others_->at(frame_index).other;
  cv::Mat outline = outline_object(image, points);
  if (outline.empty()) return mask;
  if (mask.empty()) return outline;
  const cv::Mat both = mask & outline;
  return 2 * cv::countNonZero(both) < cv::countNonZero(outline) ? outline : both;
}

}  // namespace mono_pose_tracker
