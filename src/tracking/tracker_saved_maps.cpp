// Saving maps of a run, and continuing in loaded ones.

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

namespace {

bool has_frame_from_zero_on(const Map& map) {
  const auto is_new = [](const auto& entry) { return !is_of_earlier_run(entry.second.frame_index); };
  return std::any_of(map.keyframes().begin(), map.keyframes().end(), is_new) ||
         std::any_of(map.removed_keyframes().begin(), map.removed_keyframes().end(), is_new);
}

}  // namespace

std::optional<SavedMaps> Tracker::Impl::copy_maps() {
  if (!worker_.latest()) return std::nullopt;
  SavedMaps saved{descriptor_kind(options_), sessions_, {}};
  worker_.ask([&](const Mapper& mapper) { saved.maps = mapper.all_maps(); });
  // Frames of earlier runs have negative indices. A run without frames in the maps is not recorded.
  if (std::any_of(saved.maps.begin(), saved.maps.end(), has_frame_from_zero_on)) {
    saved.sessions.push_back({camera_.parameters(), 0, next_index_});
  }
  return saved;
}

void Tracker::Impl::load_maps(SavedMaps saved) {
  if (saved.maps.empty()) throw std::invalid_argument("there is no map to load");
  if (saved.descriptor != descriptor_kind(options_)) {
    throw std::invalid_argument("the map's descriptors are of another kind (" + saved.descriptor +
                                "), expected " + descriptor_kind(options_));
  }
  saved.end_before_zero();  // new frames are counted from next_index_
  reset();
  worker_.begin(epoch_, [&](Mapper& mapper) { mapper.restore(saved.maps.front(), epoch_); });
  TrackingMapPtr largest = worker_.latest();
  for (std::size_t i = 1; i < saved.maps.size(); ++i) {
    const TrackingMapPtr before = worker_.latest();
    others_[before->map_id] = before;
    change_map([&](Mapper& mapper) { mapper.restore_additional(saved.maps[i], epoch_); });
    const TrackingMapPtr map = worker_.latest();
    if (map->keyframes.size() > largest->keyframes.size()) largest = map;
  }
  if (largest->map_id != worker_.latest()->map_id) go_back_to(largest->map_id, true);
  sessions_ = std::move(saved.sessions);
  present_map_ = largest->map_id;
  state_ = State::kLost;
  frames_lost_ = 1;
  reference_ = largest->keyframes.rbegin()->first;
}

void Tracker::Impl::restart() {
  const TrackingMapPtr map = worker_.latest();
  if (!map) return reset();
  object_finder_.reset();
  frames_.clear();
  tentative_.reset();
  motion_.reset();
  change_map([&](Mapper& mapper) { mapper.resume(map->map_id, true, epoch_); });
  state_ = State::kLost;
  frames_lost_ = 1;
}

}  // namespace mono_pose_tracker
