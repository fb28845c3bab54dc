// Images of a finished recording that have no pose yet: from those beside them, by descriptors, in a map
// beside.

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Where the motion of the frames beside it leads; nothing where these have no pose.
std::optional<Prediction> Tracker::Impl::predict_beside(const Frame& frame, std::int64_t neighbor) const {
  const TrackingMapPtr map = worker_.latest();
  const FramePoses& poses = frames_.at(map->map_id);
  Rigid3 near, before;
  if (!poses.camera_from_map(*map, neighbor, &near)) return std::nullopt;
  Prediction prediction{living_ancestor(map->removed_keyframes, poses.find(neighbor)->reference), near};
  if (poses.camera_from_map(*map, 2 * neighbor - frame.index, &before))
    prediction.camera_from_map = near * before.inverse() * near;
  return prediction;
}

// A keyframe is made of it where one is due.
bool Tracker::Impl::register_in_gap(const Frame& frame, const std::optional<Prediction>& prediction) {
  const TrackingMapPtr map = worker_.latest();
  const ResectionReport resection = register_image(frame, *map, prediction);
  if (!resection.success) return false;
  const FramePose pose = set_pose(frame, *map, resection, Among::kAll);
  const Overlap overlap = overlap_with(*map, pose.reference, resection, camera_);
  if (!options_.localize_only && keyframe_policy_.is_due(*map, overlap, resection.inliers, 0)) {
    grown_ = worker_.insert(candidate_of(frame, *map, pose, resection)) || grown_;
    apply_corrections(*worker_.latest());
  }
  return true;
}

// Frames without a pose, from the frames beside them that have one: forwards, then backwards.
bool Tracker::Impl::fill_gaps_once() {
  bool any = false;
  const auto try_beside = [&](std::int64_t index, std::int64_t neighbor) {
    const Frame& frame = unposed_.at(index);
    if (!frames_[worker_.latest()->map_id].find(neighbor) ||
        !register_in_gap(frame, predict_beside(frame, neighbor))) {
      return;
    }
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

// The present map's.
void Tracker::Impl::fill_its_gaps() {
  while (fill_gaps_once()) {
  }
  pose_anywhere();
  while (fill_gaps_once()) {
  }
}

void Tracker::Impl::fill_gaps() {
  grown_ = false;
  fill_its_gaps();
  if (!options_.localize_only) fill_gaps_beside();
  unposed_.clear();
  if (grown_) complete_map();
}

bool Tracker::Impl::is_found(const ResectionReport& resection) const {
  return resection.success && is_supported(resection.support, options_.resection.min_inliers);
}

void Tracker::Impl::pose_anywhere() {
  for (auto entry = unposed_.begin(); entry != unposed_.end();) {
    entry = register_in_gap(entry->second, std::nullopt) ? unposed_.erase(entry) : std::next(entry);
  }
}

// A frame that is posed in a smaller map has been tried in the largest, which would tie them, and is done
// with.
void Tracker::Impl::leave_out_posed() {
  for (const auto& poses : frames_) {
    for (const auto& frame : poses.second.all()) unposed_.erase(frame.first);
  }
}

// What the largest map does not reach, those beside it may, or one that begins there.
void Tracker::Impl::fill_gaps_beside() {
  leave_out_posed();
  if (unposed_.empty()) return;
  const std::uint32_t largest = worker_.latest()->map_id;
  begin_in_gaps();
  leave_out_posed();
  std::vector<std::uint32_t> ids = all_maps();
  std::sort(ids.begin(), ids.end());
  for (const std::uint32_t id : ids) {
    show(id);
    if (id != largest) fill_its_gaps();
  }
  resume_largest();
}

// Those kept and the present one.
std::vector<std::uint32_t> Tracker::Impl::all_maps() {
  std::vector<std::uint32_t> ids = worker_.mapper().inactive_maps();
  ids.push_back(worker_.latest()->map_id);
  return ids;
}

// The map becomes the present one.
void Tracker::Impl::show(std::uint32_t map_id) {
  worker_.mapper().resume(map_id, true, epoch_);
  worker_.publish_mapper();
  present_map_ = worker_.latest()->map_id;
}

// The frames once more, in their order, each run of them as a camera that has been lost for long: while a
// recording goes on a new map waits for young_map_patience images, which may be all that there are.
void Tracker::Impl::begin_in_gaps() {
  const std::uint32_t largest = worker_.latest()->map_id;
  std::set<std::uint32_t> known = {largest};
  for (const std::uint32_t id : worker_.mapper().inactive_maps()) {
    show(id);
    others_[id] = worker_.latest();
    known.insert(id);
  }
  show(largest);
  std::int64_t next = -1;
  for (const auto& [index, frame] : unposed_) {
    if (index != next) {
      end_loss();
      frames_lost_ = options_.young_map_patience - 1;
      tentative_.reset();
    }
    grown_ = track_in_gap(frame) || grown_;
    next = index + 1;
  }
  drop_young_maps(known);
}

// Whether it has got a pose.
bool Tracker::Impl::track_in_gap(const Frame& frame) {
  FrameReport report;
  report.seen.resize(frame.image->size());
  TrackingMapPtr map = worker_.latest();
  apply_corrections(*map);
  ResectionReport resection;
  if (frames_lost_ == 0) {
    resection = follow(frame, *map);
  } else if (tentative_) {
    confirm(frame, &map, &resection);
  }
  if (resection.success && accept(frame, *map, resection, &report)) return true;
  motion_.reset();
  frames_lost_ = std::max(frames_lost_ + 1, options_.young_map_patience);
  if (!search(frame, &report)) bootstrap_beside(frame, &report);
  return frames_lost_ == 0;
}

// Of those that no one knew before: too little to be worth a frame and a unit of its own.
void Tracker::Impl::drop_young_maps(const std::set<std::uint32_t>& known) {
  for (const std::uint32_t id : all_maps()) {
    if (known.count(id)) continue;
    show(id);
    const std::vector<std::uint32_t> kept = worker_.mapper().inactive_maps();
    const bool young = static_cast<int>(worker_.latest()->keyframes.size()) <= options_.young_map_keyframes;
    if (young && !kept.empty()) go_back_to(kept.front(), false);
  }
}

}  // namespace mono_pose_tracker
