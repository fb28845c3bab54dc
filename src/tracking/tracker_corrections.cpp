// Updates the tracker's state when the mapper corrects, merges or drops maps.

#include <cmath>
#include <cstdint>
#include <set>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Applies corrections of the map to everything stored by its ids or in its unit.
void Tracker::Impl::apply_corrections(const TrackingMap& map) {
  for (const auto& correction : map.corrections) {
    if (correction->sequence <= corrections_) continue;
    corrections_ = correction->sequence;
    ++times_corrected_[correction->into_map];
    frames_[correction->of_map].apply(*correction);
    if (tentative_ && tentative_->map_id == correction->of_map) tentative_.reset();
    if (correction->of_map == present_map_) {
      present_map_ = correction->into_map;
      reference_ += correction->added.keyframes;
      const double scale = correction->length_scale(reference_);
      camera_from_reference_.translation *= scale;
      if (motion_) motion_->translation *= scale;
      innovation_gate_.rescale(scale);
      length_scale_ *= scale;
      if (correction->other_geometry) motion_.reset();
      if (correction->other_geometry || correction->into_map != correction->of_map ||
          std::abs(scale - 1) > limits_.other_lengths) {
        object_finder_.forget_places();
      }
    }
    if (correction->into_map == correction->of_map) continue;
    if (motion_map_ == correction->of_map) motion_map_ = correction->into_map;
    frames_[correction->into_map].take(frames_[correction->of_map]);
    frames_.erase(correction->of_map);
    others_.erase(correction->into_map);
    others_.erase(correction->of_map);
    keyframe_policy_.reset();
  }
}

// Publishes and follows map changes between images.
void Tracker::Impl::follow_mapper() {
  worker_.publish_mapper();
  apply_corrections(*worker_.latest());
}

// Forgets maps that the mapper has dropped from a capped atlas.
void Tracker::Impl::forget_dropped_maps(const TrackingMap& map) {
  if (map.epoch != epoch_) return;  // of an earlier set of maps
  const std::set<std::uint32_t> kept(map.inactive_maps.begin(), map.inactive_maps.end());
  for (auto other = others_.begin(); other != others_.end();) {
    const std::uint32_t id = other->first;
    if (kept.count(id)) {
      ++other;
      continue;
    }
    if (tentative_ && tentative_->map_id == id) tentative_.reset();
    frames_.erase(id);
    times_corrected_.erase(id);
    other = others_.erase(other);
  }
}

}  // namespace mono_pose_tracker
