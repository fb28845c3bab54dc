#include "pipeline/object_outlines.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "object_masks.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {

namespace {

// Landmarks of the nearest keyframes.
std::set<LandmarkId> landmarks_near(const Map& map, const Eigen::Vector3d& center_in_map,
                                    std::size_t keyframes) {
  std::vector<std::pair<double, const Keyframe*>> near;
  for (const auto& entry : map.keyframes()) {
    near.emplace_back((entry.second.center_in_map() - center_in_map).norm(), &entry.second);
  }
  const auto last = near.begin() + static_cast<std::ptrdiff_t>(std::min(keyframes, near.size()));
  std::partial_sort(near.begin(), last, near.end(), [](const auto& a, const auto& b) {
    return a.first < b.first || (a.first == b.first && a.second->id < b.second->id);
  });
  std::set<LandmarkId> landmarks;
  for (auto k = near.begin(); k != last; ++k) {
    for (const LandmarkId l : k->second->landmark_of_feature) {
      if (l != kNoLandmark) landmarks.insert(l);
    }
  }
  return landmarks;
}

}  // namespace

ObjectOutlines::ObjectOutlines(const RecordingResult& result, const CameraModel& camera,
                               const ObjectOutlinesOptions& options)
    : map_(result.maps.front().map), camera_(camera), options_(options) {
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
  for (const LandmarkId l :
       landmarks_near(map_, pose->second.inverse().translation, options_.nearest_keyframes)) {
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
