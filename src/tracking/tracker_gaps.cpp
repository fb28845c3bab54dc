// Images of a finished recording that have no pose yet: from those beside them, by descriptors, in a map
// beside.

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Where the motion of the frames beside it leads; nothing where these have no pose.
std::optional<Prediction> Tracker::Impl::predict_from_neighbor(const Frame& frame,
                                                               std::int64_t neighbor) const {
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
  const RegistrationReport registration = register_image(frame, *map, prediction);
  if (!registration.success) return false;
  const FramePose pose = set_pose(frame, *map, registration, Among::kAll);
  const Overlap overlap = overlap_with(*map, pose.reference, registration, camera_);
  if (!options_.localize_only && keyframe_policy_.is_due(*map, overlap, registration.inliers, 0)) {
    grown_ = worker_.insert(candidate_of(frame, *map, pose, registration)) || grown_;
    apply_corrections(*worker_.latest());
  }
  return true;
}

// Frames without a pose, from the frames beside them that have one: forwards, then backwards.
bool Tracker::Impl::fill_gaps_once() {
  bool any = false;
  const auto try_neighbor = [&](std::int64_t index, std::int64_t neighbor) {
    const Frame& frame = unregistered_.at(index);
    if (!frames_[worker_.latest()->map_id].find(neighbor) ||
        !register_in_gap(frame, predict_from_neighbor(frame, neighbor))) {
      return;
    }
    unregistered_.erase(index);
    any = true;
  };
  std::vector<std::int64_t> indices;
  for (const auto& entry : unregistered_) indices.push_back(entry.first);
  for (const std::int64_t index : indices) try_neighbor(index, index - 1);
  for (auto index = indices.rbegin(); index != indices.rend(); ++index) {
    if (unregistered_.count(*index)) try_neighbor(*index, *index + 1);
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
  if (!options_.localize_only) fill_gaps_in_other_maps();
  unregistered_.clear();
  if (grown_) complete_map();
}

bool Tracker::Impl::is_found(const RegistrationReport& registration) const {
  return registration.success && is_supported(registration.support, options_.resection.min_inliers);
}

void Tracker::Impl::pose_anywhere() {
  for (auto entry = unregistered_.begin(); entry != unregistered_.end();) {
    entry = register_in_gap(entry->second, std::nullopt) ? unregistered_.erase(entry) : std::next(entry);
  }
}

// A frame that is posed in a smaller map has been tried in the largest, which would tie them, and is done
// with.
void Tracker::Impl::exclude_registered() {
  for (const auto& poses : frames_) {
    for (const auto& frame : poses.second.all()) unregistered_.erase(frame.first);
  }
}

// What the largest map does not reach, those beside it may, or one that begins there.
void Tracker::Impl::fill_gaps_in_other_maps() {
  exclude_registered();
  if (unregistered_.empty()) return;
  const std::uint32_t largest = worker_.latest()->map_id;
  begin_in_gaps();
  exclude_registered();
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
  for (const auto& [index, frame] : unregistered_) {
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
  RegistrationReport registration;
  if (frames_lost_ == 0) {
    registration = follow(frame, *map);
  } else if (tentative_) {
    confirm(frame, &map, &registration);
  }
  if (registration.success && accept(frame, *map, registration, &report)) return true;
  motion_.reset();
  frames_lost_ = std::max(frames_lost_ + 1, options_.young_map_patience);
  if (!search(frame, &report)) bootstrap_additional(frame, &report);
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
