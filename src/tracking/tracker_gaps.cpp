// Registers images of a finished recording that have no pose yet: from their neighbours, by descriptors, in
// other maps.

#include <algorithm>
#include <iterator>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Predicts a pose from the motion of the neighbouring frames; nothing where these have no pose.
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

// Registers the frame, and makes it a keyframe where one is due.
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

// Registers frames from their registered neighbours: forwards, then backwards.
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

// Fills the gaps of the present map.
void Tracker::Impl::fill_its_gaps() {
  while (fill_gaps_once()) {
  }
  for (auto entry = unregistered_.begin(); entry != unregistered_.end();) {
    entry = register_in_gap(entry->second, std::nullopt) ? unregistered_.erase(entry) : std::next(entry);
  }
  while (fill_gaps_once()) {
  }
}

void Tracker::Impl::fill_gaps() {
  grown_ = false;
  fill_its_gaps();
  if (!options_.localize_only) fill_gaps_in_other_maps();
  unregistered_.clear();
  if (grown_) merge_and_finish();
}

bool Tracker::Impl::is_found(const RegistrationReport& registration) const {
  return registration.success && is_supported(registration.support, options_.resection.min_inliers);
}

// Drops frames that are registered in a smaller map: registration in the largest, which would connect the
// two, was tried before.
void Tracker::Impl::exclude_registered() {
  for (const auto& poses : frames_) {
    for (const auto& frame : poses.second.all()) unregistered_.erase(frame.first);
  }
}

// Frames out of reach of the largest map may be in the other maps, or begin a map.
void Tracker::Impl::fill_gaps_in_other_maps() {
  exclude_registered();
  if (unregistered_.empty()) return;
  const std::uint32_t largest = worker_.latest()->map_id;
  begin_in_gaps();
  exclude_registered();
  for (const std::uint32_t id : all_maps()) {
    show(id);
    if (id != largest) fill_its_gaps();
  }
  resume_largest();
}

// Ids of the inactive maps and the present one, the oldest first.
std::vector<std::uint32_t> Tracker::Impl::all_maps() {
  std::vector<std::uint32_t> ids = worker_.mapper().inactive_maps();
  ids.push_back(worker_.latest()->map_id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

// Makes the map the present one.
void Tracker::Impl::show(std::uint32_t map_id) {
  worker_.mapper().resume(map_id, true, epoch_);
  worker_.publish_mapper();
  present_map_ = worker_.latest()->map_id;
}

// Tracks the remaining frames once more in order, each sequence as a camera that has been lost for long.
// During the recording a new map waits for young_map_patience images, which may be more than there are.
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

// Returns whether the frame was registered.
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

// Drops new young maps: they are too small to be worth a frame and unit of their own.
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
