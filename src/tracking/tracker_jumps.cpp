// The end of a recording: whether the path jumps to and fro, or the camera does.

#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

std::set<std::int64_t> Tracker::Impl::jumping_frames() {
  steps_ = {};
  const TrackingMapPtr map = worker_.latest();
  if (!map) return {};
  steps_.map_id = map->map_id;
  const std::vector<PosedFrame> frames = trajectory();
  const std::set<std::int64_t> wanted = frames_at_jumps(frames, least_stray(*map));
  for (const PosedFrame& frame : frames) {
    if (wanted.count(frame.index) > 0) steps_.camera_from_map[frame.index] = frame.map_from_camera.inverse();
  }
  return wanted;
}

// The keyframe that it stands on, or is; -1: it has no pose in the map.
KeyframeId Tracker::Impl::reference_of(std::int64_t frame_index, const TrackingMap& map) const {
  const auto frames = frames_.find(map.map_id);
  const FramePose* pose = frames == frames_.end() ? nullptr : frames->second.find(frame_index);
  if (pose) return living_ancestor(map.removed_keyframes, pose->reference);
  for (const auto& [id, keyframe] : map.keyframes) {
    if (keyframe.frame_index == frame_index) return id;
  }
  return -1;
}

void Tracker::Impl::look_at_step(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                                 const cv::Mat& mask) {
  const TrackingMapPtr map = worker_.latest();
  const auto pose = steps_.camera_from_map.find(frame_index);
  const KeyframeId reference = map ? reference_of(frame_index, *map) : -1;
  if (reference < 0 || pose == steps_.camera_from_map.end()) return;
  FrameReport report;
  const std::optional<Frame> frame = make_frame_again(frame_index, stamp_ns, image, mask, &report);
  if (!frame) return;
  PosedSight sight{pose->second, frame->image, {}, {}};
  for (const FrameObservation& o : resector_.observations_at(*frame, *map, reference, pose->second)) {
    sight.features.push_back(o.feature);
    sight.points.push_back(map->landmarks.at(o.landmark));
  }
  if (steps_.last_index + 1 == frame_index) {
    const WayShown shown = way_shown(steps_.last, sight, options_.matching);
    if (shown != WayShown::kNot) steps_.seen[frame_index] = shown == WayShown::kShown;
  }
  steps_.last_index = frame_index;
  steps_.last = std::move(sight);
}

}  // namespace mono_pose_tracker
