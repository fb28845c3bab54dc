// The end of a recording: whether the path jumps to and fro, or the camera does.

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/tracking/restless_path.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

namespace {

KeyframeId nearest_in_time(const TrackingMap& map, std::int64_t frame_index) {
  KeyframeId nearest = -1;
  std::int64_t least = 0;
  for (const auto& [id, keyframe] : map.keyframes) {
    const std::int64_t apart = std::abs(keyframe.frame_index - frame_index);
    if (nearest < 0 || apart < least) nearest = id, least = apart;
  }
  return nearest;
}

}  // namespace

std::set<std::int64_t> Tracker::Impl::jumping_frames() {
  steps_ = {};
  const TrackingMapPtr map = worker_.latest();
  if (!map) return {};
  const std::vector<PosedFrame> frames = trajectory();
  const double least = least_stray(*map);
  if (!most_restless_stretch(frames, least, {}).is_significant()) return {};
  std::set<std::int64_t> wanted = frames_at_jumps(frames, least);
  for (const PosedFrame& frame : frames) {
    if (wanted.count(frame.index) > 0) steps_.camera_from_map[frame.index] = frame.map_from_camera.inverse();
  }
  return wanted;
}

void Tracker::Impl::look_at_step(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                                 const cv::Mat& mask) {
  FrameReport report;
  const std::optional<Frame> frame = make_frame_again(frame_index, stamp_ns, image, mask, &report);
  const TrackingMapPtr map = worker_.latest();
  const auto pose = steps_.camera_from_map.find(frame_index);
  if (!frame || !map || pose == steps_.camera_from_map.end()) return;
  PosedSight sight{pose->second, frame->image, {}, {}};
  for (const FrameObservation& o :
       resector_.observations_at(*frame, *map, nearest_in_time(*map, frame_index), pose->second)) {
    sight.features.push_back(o.feature);
    sight.points.push_back(map->landmarks.at(o.landmark));
  }
  if (steps_.last_index + 1 == frame_index && show_the_way(steps_.last, sight, options_.matching)) {
    steps_.shown.insert(frame_index);
  }
  steps_.last_index = frame_index;
  steps_.last = std::move(sight);
}

}  // namespace mono_pose_tracker
