// The end of a recording: maps are joined and finished, images without a pose get one.

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "occlusion.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

bool Tracker::Impl::finish() {
  worker_.wait();
  if (state_ == State::kBootstrapping) {
    if (options_.localize_only) return false;
    const std::optional<BootstrapReport> known = bootstrap_job_.take(epoch_);
    if (!known || !known->map) {
      if (next_index_ != 2) return false;
      const BootstrapReport two_views = bootstrap_job_.bootstrapper().unconfirmed();
      if (!two_views.map) return false;
      worker_.initialize(*two_views.map, epoch_);
      unconfirmed_ = true;
    }
    start_map();
  }
  if (!options_.localize_only) {
    complete_map();
  } else if (!others_.empty()) {
    resume_largest();
  }
  return true;
}

// Maps are joined where they meet; the largest is completed and adjusted.
void Tracker::Impl::complete_map() {
  if (!others_.empty()) {
    worker_.mapper().join_rest();
    worker_.publish_mapper();
    apply_corrections(*worker_.latest());
    resume_largest();
  }
  worker_.mapper().finish();
  worker_.publish_mapper();
}

// The map in which most frames are posed becomes the present one; of equals, the oldest.
void Tracker::Impl::resume_largest() {
  Mapper& mapper = worker_.mapper();
  std::vector<std::uint32_t> ids = mapper.kept_maps();
  ids.push_back(worker_.latest()->map_id);
  std::sort(ids.begin(), ids.end());
  const std::uint32_t largest = *std::max_element(
      ids.begin(), ids.end(), [&](auto a, auto b) { return frames_[a].size() < frames_[b].size(); });
  mapper.resume(largest, true, epoch_);
  worker_.publish_mapper();
  others_.clear();
  for (const std::uint32_t id : mapper.kept_maps()) others_[id] = nullptr;
}

// The best of the keyframes nearest in time and of those that look like it most.
ResectionReport Tracker::Impl::resect_near(const Frame& frame, const TrackingMap& map) const {
  constexpr std::size_t kNearInTime = 4;
  std::vector<std::pair<std::int64_t, KeyframeId>> by_time;
  for (const auto& [id, keyframe] : map.keyframes) {
    by_time.emplace_back(std::abs(keyframe.frame_index - frame.index), id);
  }
  std::sort(by_time.begin(), by_time.end());
  ResectionReport best;
  for (std::size_t i = 0; i < std::min(by_time.size(), kNearInTime); ++i) {
    ResectionReport report = resector_.resect(frame, map, by_time[i].second, std::nullopt);
    if (is_better(report, best)) best = std::move(report);
  }
  ResectionReport elsewhere = resector_.relocalize(frame, map, options_.resection.relocalization_keyframes);
  return is_better(best, elsewhere) ? best : elsewhere;
}

std::optional<Frame> Tracker::Impl::make_frame_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                                     const PreparedImage& image, const cv::Mat& mask,
                                                     FrameReport* report) {
  report->stamp_ns = stamp_ns;
  if (!frame_maker_.has_camera_size(image.image, report)) return std::nullopt;
  return make_frame(frame_index, stamp_ns, image, object_finder_.find_again(image.image, mask), report);
}

FrameReport Tracker::Impl::keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns,
                                          const PreparedImage& image, const cv::Mat& mask) {
  FrameReport report;
  if (auto frame = make_frame_again(frame_index, stamp_ns, image, mask, &report)) {
    unposed_[frame_index] = std::move(*frame);
  }
  return report;
}

// Beside a frame that is posed: where that one is, moved on as the frames before it moved.
bool Tracker::Impl::pose_beside(const Frame& frame, std::int64_t neighbor) {
  const TrackingMapPtr map = worker_.latest();
  FramePoses& poses = frames_[map->map_id];
  Rigid3 near, before;
  if (!poses.camera_from_map(*map, neighbor, &near)) return false;
  const KeyframeId rides_on = poses.find(neighbor)->reference;
  const KeyframeId reference = map->keyframes.count(rides_on) ? rides_on : map->keyframes.rbegin()->first;
  Rigid3 predicted = near;
  if (poses.camera_from_map(*map, 2 * neighbor - frame.index, &before)) {
    predicted = near * before.inverse() * near;
  }
  const ResectionReport resection = resector_.resect(frame, *map, reference, predicted);
  if (!resection.success || !is_supported(resection.support, options_.resection.min_inliers)) return false;
  frames_lost_ = 1;  // not beside the frame that was tracked last: any keyframe may be the reference
  const KeyframeId best = choose_reference(*map, resection);
  const Rigid3 camera_from_best =
      resection.camera_from_map * map->keyframes.at(best).camera_from_map.inverse();
  poses.set(frame.index, {frame.stamp_ns, best, camera_from_best});
  const Overlap overlap = overlap_with(*map, best, resection, camera_);
  if (!options_.localize_only && keyframe_policy_.is_due(*map, overlap, resection.inliers, 0)) {
    KeyframeCandidate candidate{frame, best, camera_from_best, resection.observations, corrections_};
    if (frame.is_masked) leave_out_occluders(*map, camera_, resection.camera_from_map, &candidate);
    grown_ = worker_.insert(candidate) || grown_;
    apply_corrections(*worker_.latest());
  }
  return true;
}

// Frames without a pose, from the frames beside them that have one: forwards, then backwards.
bool Tracker::Impl::fill_gaps_once() {
  bool any = false;
  const auto try_beside = [&](std::int64_t index, std::int64_t neighbor) {
    if (!frames_[worker_.latest()->map_id].find(neighbor) || !pose_beside(unposed_.at(index), neighbor))
      return;
    unposed_.erase(index);
    any = true;
  };
  std::vector<std::int64_t> indices;
  for (const auto& entry : unposed_) indices.push_back(entry.first);
  for (const std::int64_t index : indices) try_beside(index, index - 1);
  for (auto index = indices.rbegin(); index != indices.rend(); ++index) {
    if (unposed_.count(*index)) try_beside(*index, *index + 1);
  }
  return any;
}

void Tracker::Impl::fill_gaps() {
  grown_ = false;
  while (fill_gaps_once()) {
  }
  pose_anywhere();
  while (fill_gaps_once()) {
  }
  unposed_.clear();
  if (grown_) complete_map();
}

// By descriptors alone, near keyframes first in time.
ResectionReport Tracker::Impl::pose_by_descriptors(const Frame& frame, const TrackingMap& map) {
  ResectionReport resection = resect_near(frame, map);
  resection.success = resection.success && is_supported(resection.support, options_.resection.min_inliers);
  if (!resection.success) return resection;
  const KeyframeId reference = choose_reference(map, resection);
  frames_[map.map_id].set(
      frame.index, {frame.stamp_ns, reference,
                    resection.camera_from_map * map.keyframes.at(reference).camera_from_map.inverse()});
  return resection;
}

void Tracker::Impl::pose_anywhere() {
  const TrackingMapPtr map = worker_.latest();
  frames_lost_ = 1;  // as in pose_beside
  for (auto entry = unposed_.begin(); entry != unposed_.end();) {
    entry = pose_by_descriptors(entry->second, *map).success ? unposed_.erase(entry) : std::next(entry);
  }
}

FinishedMap Tracker::Impl::finished(const TrackingMap& view) {
  FinishedMap map;
  map.id = view.map_id;
  map.trajectory = trajectory_in(view, frames_[view.map_id]);
  map.map = worker_.mapper().map();
  map.snapshot = snapshot_of(worker_.mapper().tracking_map());
  map.seam = weakest_seam(map.map);
  map.depth_evidence = depth_evidence(options_.bundle, map.map);
  map.contradiction = worst_contradiction(map.map, camera_, options_.matching);
  map.confirmed = !unconfirmed_ && map.seam.holds() && map.is_sure();
  return map;
}

std::vector<FinishedMap> Tracker::Impl::maps() {
  const TrackingMapPtr present = worker_.latest();
  if (!present) return {};
  std::vector<FinishedMap> maps = {finished(*present)};
  Mapper& mapper = worker_.mapper();
  for (const std::uint32_t id : mapper.kept_maps()) {
    mapper.resume(id, true, epoch_);
    if (!options_.localize_only) mapper.finish();
    maps.push_back(finished(*mapper.tracking_map()));
  }
  mapper.resume(present->map_id, true, epoch_);
  worker_.publish_mapper();
  std::stable_sort(maps.begin() + 1, maps.end(), [](const FinishedMap& a, const FinishedMap& b) {
    return a.trajectory.size() > b.trajectory.size();
  });
  return maps;
}

FrameReport Tracker::Impl::resect_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                        const PreparedImage& image, const cv::Mat& mask) {
  FrameReport report;
  const std::optional<Frame> frame = make_frame_again(frame_index, stamp_ns, image, mask, &report);
  const TrackingMapPtr map = worker_.latest();
  if (frame && map) describe(pose_by_descriptors(*frame, *map), &report);
  finish_report(&report);
  return report;
}

}  // namespace mono_pose_tracker
