#include "mono_pose_tracker/map/frame_poses.h"

namespace mono_pose_tracker {

const FramePose* FramePoses::find(std::int64_t index) const {
  const auto found = poses_.find(index);
  return found == poses_.end() ? nullptr : &found->second;
}

void FramePoses::keep_newest(std::size_t most) {
  while (poses_.size() > most) poses_.erase(poses_.begin());
}

void FramePoses::apply(const MapCorrection& correction) {
  for (auto& [index, pose] : poses_) {
    pose.reference += correction.added.keyframes;
    pose.camera_from_reference.translation *= correction.length_scale(pose.reference);
  }
}

void FramePoses::take(const FramePoses& other) { poses_.insert(other.poses_.begin(), other.poses_.end()); }

bool FramePoses::camera_from_map(const TrackingMap& map, std::int64_t index, Rigid3* camera_from_map) const {
  const FramePose* pose = find(index);
  Rigid3 reference_from_map;
  if (!pose || !map.camera_from_map(pose->reference, &reference_from_map)) return false;
  *camera_from_map = pose->camera_from_reference * reference_from_map;
  return true;
}

}  // namespace mono_pose_tracker
