// A lost camera: relocalises in the maps, or begins an additional one.

#include <algorithm>
#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// The view of an inactive map; null: there is none.
TrackingMapPtr Tracker::Impl::inactive_view(std::uint32_t map_id) const {
  const auto other = others_.find(map_id);
  return other == others_.end() ? nullptr : other->second;
}

// Searches a lost frame in the present map and the inactive ones, a few keyframes of each at a time. A result
// is held back until a second view agrees.
bool Tracker::Impl::search(const Frame& frame, FrameReport* report) {
  const StageTimer timer(report->stages, "relocalize");
  const int maps = 1 + static_cast<int>(others_.size());
  const int budget = std::max(2, options_.resection.relocalization_keyframes / maps);
  const TrackingMapPtr present = worker_.latest();
  std::uint32_t map_id = present->map_id;
  RegistrationReport best = registrar_.relocalize(frame, *present, budget);
  // A frame that is ambiguous in one map may be ambiguous in another as well.
  const auto is_answer = [](const RegistrationReport& found) {
    return found.success || found.reason == Reason::kAmbiguousPose;
  };
  for (auto& [id, other] : others_) {
    if (is_answer(best)) break;
    RegistrationReport elsewhere = registrar_.relocalize(frame, *other, budget);
    if (is_answer(elsewhere)) best = std::move(elsewhere), map_id = id;
  }
  if (!best.success) {
    if (frames_lost_ > 1 || report->reason_text.empty()) describe(best, report);
    return false;
  }
  const TrackingMapPtr found_in = map_id == present->map_id ? present : others_.at(map_id);
  tentative_ = {map_id, frame.index, pose_of(frame, *found_in, best, Among::kAll)};
  report->inliers = best.inliers;
  report->matches = best.matches;
  report->reason_text =
      "found by " + std::to_string(best.inliers) + " points, a second image must confirm the pose";
  return true;
}

// Whether this frame confirms the tentative pose of the one before. present: becomes the map in which it was
// found.
bool Tracker::Impl::confirm(const Frame& frame, TrackingMapPtr* present, RegistrationReport* registration) {
  const Tentative tentative = *std::exchange(tentative_, std::nullopt);
  const TrackingMapPtr map =
      (*present)->map_id == tentative.map_id ? *present : inactive_view(tentative.map_id);
  Rigid3 reference_from_map;
  if (!map || !map->camera_from_map(tentative.pose.reference, &reference_from_map)) return false;
  const KeyframeId reference = living_ancestor(map->removed_keyframes, tentative.pose.reference);
  *registration = registrar_.register_frame(frame, *map, reference,
                                            tentative.pose.camera_from_reference * reference_from_map);
  if (!is_found(*registration)) {
    if (registration->success)
      registration->text = "the second image does not confirm the pose of the last one";
    registration->success = false;
    return false;
  }
  if ((*present)->map_id != tentative.map_id) {
    if (!go_back_to(tentative.map_id, true)) {
      registration->text = "the map of this pose has been merged into another map";
      registration->success = false;
      return false;
    }
    *present = worker_.latest();
  }
  reference_ = reference;  // no longer the place of the loss
  frames_[tentative.map_id].set(tentative.index, tentative.pose);
  return true;
}

// Returns false when the map no longer exists, as it was merged with another. The present one then continues.
bool Tracker::Impl::go_back_to(std::uint32_t map_id, bool keep_present) {
  const TrackingMapPtr present = worker_.latest();
  apply_corrections(*present);
  ++epoch_;
  worker_.begin(epoch_, [&](Mapper& mapper) { mapper.resume(map_id, keep_present, epoch_); });
  present_map_ = worker_.latest()->map_id;
  keyframe_policy_.reset();
  innovation_gate_.reset();
  object_finder_.forget_places();
  if (present_map_ != map_id) return false;
  others_.erase(map_id);
  if (keep_present) {
    others_[present->map_id] = present;
  } else {
    frames_.erase(present->map_id);
    if (motion_map_ == present->map_id) object_finder_.reset();
  }
  return true;
}

// Drops a map that is too young to be kept.
void Tracker::Impl::drop_young_map(FrameReport* report) {
  report->reason_text += "; the young map is dropped, and a new one is started";
  if (others_.empty()) {
    begin_anew();
  } else {
    go_back_to(others_.rbegin()->first, false);
  }
}

// Begins an additional map after a long loss. It is merged with the others once they can be aligned.
void Tracker::Impl::bootstrap_additional(const Frame& frame, FrameReport* report) {
  const StageTimer timer(report->stages, "bootstrap");
  if (!std::exchange(seeks_additional_map_, true)) ++searches_;
  const std::uint32_t key = ~searches_;  // larger than any epoch of a map
  std::optional<BootstrapReport> known = bootstrap_job_.take(key);
  if (!known || !known->map) {
    bootstrap_job_.offer_additional(frame, key, &worker_);
    if (!known) known = bootstrap_job_.take(key);
  }
  if (!known) return;
  report->reason_text += "; for a new map: " + known->text;
  if (!known->map) return;
  const TrackingMapPtr before = worker_.latest();
  apply_corrections(*before);
  ++epoch_;
  worker_.begin(epoch_, [&](Mapper& mapper) { mapper.begin_additional(*known->map, epoch_); });
  others_[before->map_id] = before;
  keyframe_policy_.reset();
  innovation_gate_.reset();
  object_finder_.forget_places();
  start_map();
  const TrackingMapPtr map = worker_.latest();
  const RegistrationReport registration =
      registrar_.register_frame(frame, *map, reference_, map->keyframes.at(reference_).camera_from_map);
  if (!registration.success) {
    go_back_to(before->map_id, false);
    state_ = State::kLost;
    frames_lost_ = options_.young_map_patience;
    return;
  }
  // For a frame out of order, the motion mask has seen another image last.
  const bool is_last = frame.index + 1 == next_index_;
  if (is_last && !known->static_background.empty()) start_motion(*known, frame, registration);
  begin_in(frame, *map, registration, known->text, report);
}

}  // namespace mono_pose_tracker
