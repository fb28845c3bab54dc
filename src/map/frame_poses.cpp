#include "map/frame_poses.h"

#include <algorithm>
#include <iterator>

namespace mono_pose_tracker {

namespace {

/// The map that the landmarks are of became part of another, whose ids go on from there.
LandmarkPixels with_ids_moved(const LandmarkPixels& landmarks, LandmarkId added) {
  if (!landmarks || added == 0) return landmarks;
  auto moved = std::make_shared<std::vector<LandmarkPixel>>(*landmarks);
  for (LandmarkPixel& seen : *moved) seen.landmark += added;
  return moved;
}

bool is_before(const FramePoses::Entry& entry, std::int64_t index) { return entry.first < index; }

}  // namespace

void FramePoses::set(std::int64_t index, const FramePose& pose) {
  const auto at = std::lower_bound(poses_.begin(), poses_.end(), index, is_before);
  if (at != poses_.end() && at->first == index) {
    at->second = pose;
  } else {
    poses_.insert(at, {index, pose});
  }
}

const FramePose* FramePoses::find(std::int64_t index) const {
  const auto at = std::lower_bound(poses_.begin(), poses_.end(), index, is_before);
  return at == poses_.end() || at->first != index ? nullptr : &at->second;
}

void FramePoses::erase(std::int64_t index) {
  const auto at = std::lower_bound(poses_.begin(), poses_.end(), index, is_before);
  if (at != poses_.end() && at->first == index) poses_.erase(at);
}

void FramePoses::keep_newest(std::size_t most) {
  while (poses_.size() > most) poses_.pop_front();
}

void FramePoses::apply(const MapCorrection& correction) {
  for (auto& [index, pose] : poses_) {
    pose.reference += correction.added.keyframes;
    pose.camera_from_reference.translation *= correction.length_scale(pose.reference);
    pose.is_stale = pose.is_stale || correction.other_geometry;
    pose.landmarks = with_ids_moved(pose.landmarks, correction.added.landmarks);
  }
}

void FramePoses::take(const FramePoses& other) {
  std::deque<Entry> all;
  // Of a frame in both, set_union takes the first's.
  std::set_union(poses_.begin(), poses_.end(), other.poses_.begin(), other.poses_.end(),
                 std::back_inserter(all), [](const Entry& a, const Entry& b) { return a.first < b.first; });
  poses_ = std::move(all);
}

RegisteredLandmarks FramePoses::landmarks() const {
  RegisteredLandmarks registered;
  for (const auto& [index, pose] : poses_) {
    if (pose.landmarks) registered.emplace_hint(registered.end(), index, pose.landmarks);
  }
  return registered;
}

bool FramePoses::camera_from_map(const TrackingMap& map, std::int64_t index, Rigid3* camera_from_map) const {
  const FramePose* pose = find(index);
  Rigid3 reference_from_map;
  if (!pose || !map.camera_from_map(pose->reference, &reference_from_map)) return false;
  *camera_from_map = pose->camera_from_reference * reference_from_map;
  return true;
}

}  // namespace mono_pose_tracker
