// A lost camera: relocalises in the maps, or begins an additional one. Live, the same for another object.

#include <algorithm>
#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Searches a lost frame in the present map and the inactive ones, a few keyframes of each at a time. A result
// is held back until a second view agrees.
bool Tracker::Impl::search(const Frame& frame, FrameReport* report) {
  const StageTimer timer(report->stages, "relocalize");
  const int maps = 1 + static_cast<int>(others_.size());
  const int budget = std::max(2, options_.resection.relocalization_keyframes / maps);
  TrackingMapPtr found_in = worker_.latest();
  RegistrationReport best = registrar_.relocalize(frame, *found_in, budget);
  // A frame that is ambiguous in one map may be ambiguous in another as well.
  const auto is_answer = [](const RegistrationReport& found) {
    return found.success || found.reason == Reason::kAmbiguousPose;
  };
  for (const auto& entry : others_) {
    if (is_answer(best)) break;
    RegistrationReport elsewhere = registrar_.relocalize(frame, *entry.second, budget);
    if (is_answer(elsewhere)) best = std::move(elsewhere), found_in = entry.second;
  }
  if (!best.success) {
    if (frames_lost_ > 1 || report->reason_text.empty()) describe(best, report);
    return false;
  }
  tentative_ = {found_in->map_id, frame.index, pose_of(frame, *found_in, best, Among::kAll)};
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
  const bool is_here = (*present)->map_id == tentative.map_id;
  if (!is_here && others_.count(tentative.map_id) == 0) return false;
  const TrackingMapPtr map = is_here ? *present : others_.at(tentative.map_id);
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
  if (!is_here) {
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

// Begins an epoch in another map.
void Tracker::Impl::change_map(const std::function<void(Mapper&)>& change) {
  ++epoch_;
  worker_.begin(epoch_, change);
  keyframe_policy_.reset();
  innovation_gate_.reset();
  object_finder_.forget_places();
}

// Returns false when the map no longer exists, as it was merged with another. The present one then continues.
bool Tracker::Impl::go_back_to(std::uint32_t map_id, bool keep_present) {
  const TrackingMapPtr present = worker_.latest();
  apply_corrections(*present);
  change_map([&](Mapper& mapper) { mapper.resume(map_id, keep_present, epoch_); });
  present_map_ = worker_.latest()->map_id;
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
  const std::optional<BootstrapReport> known = bootstrap_job_.add(frame, key, false, &worker_);
  if (!known) return;
  report->reason_text += "; for a new map: " + known->text;
  if (!known->map) return;
  const TrackingMapPtr before = worker_.latest();
  apply_corrections(*before);
  change_map([&](Mapper& mapper) { mapper.begin_additional(*known->map, epoch_); });
  others_[before->map_id] = before;
  if (begin_in_new_map(frame, *known, report).success) return;
  go_back_to(before->map_id, false);
  state_ = State::kLost;
  frames_lost_ = options_.young_map_patience;
}

// Reduces the frame to the features of the followed object, where there is one in view.
Frame Tracker::Impl::followed(const Frame& frame, FrameReport* report) {
  Frame of_object = frame;
  if (!object_follower_) return of_object;
  const StageTimer timer(report->stages, "segment");
  if (object_follower_->follow(options_, &of_object)) show_features(of_object, report);
  return of_object;
}

// Drops a map of an object that rotates less than another one, or of its static background as well, and
// begins a map of the other one. Returns false when the map continues.
bool Tracker::Impl::switch_to_other_object(const TrackingMap& map, const Frame& frame, FrameReport* report) {
  if (pace_ != SearchPace::kLive || !map.turning_object || objects_abandoned_ >= limits_.objects_left)
    return false;
  if (options_.localize_only || has_earlier_frames(map)) return false;
  const int left = objects_abandoned_ + 1;
  const bool begins_anew = others_.empty();
  if (begins_anew) {
    begin_anew();
  } else if (!go_back_to(others_.rbegin()->first, false)) {
    return false;
  }
  objects_abandoned_ = left;
  object_follower_.emplace(*map.turning_object);
  const Frame of_object = followed(frame, report);
  if (begins_anew) {
    const StageTimer timer(report->stages, "bootstrap");
    bootstrap(of_object, report);
  } else {
    frames_lost_ = options_.young_map_patience - 1;
    show_features(frame, report);
    lose(frame, of_object, report);
  }
  report->reason_text = map.doubt + "; this map is dropped: " + report->reason_text;
  return true;
}

// Registers by the features of the followed object. Where there is none, where it was confused with something
// else or lost, registers by all features of the frame, and locates the object by the inliers. map: becomes
// the map in which the frame was found, if that is another one.
RegistrationReport Tracker::Impl::locate(const Frame& frame, TrackingMapPtr* map, Frame* of_object,
                                         FrameReport* report) {
  const StageTimer timer(report->stages, "resect");
  RegistrationReport registration;
  if (frames_lost_ == 0 && of_object->unmasked) registration = follow(*of_object, **map);
  if (registration.success) return registration;
  if (frames_lost_ == 0) {
    registration = follow(frame, **map);
  } else if (tentative_) {
    confirm(frame, map, &registration);
  }
  if (!object_follower_) return registration;
  show_features(frame, report);
  if (!registration.success) return registration;
  const Frame settled = object_follower_->settle(frame, pixels_of(frame, registration));
  const RegistrationReport again = registrar_.register_frame(
      settled, **map, choose_reference(**map, registration, frames_lost_ == 0 ? Among::kNear : Among::kAll),
      registration.camera_from_map);
  *of_object = again.success ? settled : frame;
  show_features(*of_object, report);
  return again.success ? again : registration;
}

}  // namespace mono_pose_tracker
