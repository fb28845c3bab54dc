// Live tracking of the object that rotates: drops maps of other objects, and reduces images to its features.

#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

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
