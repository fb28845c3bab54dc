// The body that turns, live: a map of another is dropped, and images are left only its features.

#include <utility>

#include "tracker_impl.h"

namespace mono_pose_tracker {

// With the features of the body that turns, where there is one to be followed and it is in view.
Frame Tracker::Impl::followed(const Frame& frame, FrameReport* report) {
  Frame of_body = frame;
  if (!body_) return of_body;
  const StageTimer timer(report->stages, "segment");
  if (body_->follow(camera_, options_, &of_body)) show_features(of_body, report);
  return of_body;
}

// Where the map is of a body that turns less than another, or of what stands still behind it as well, it is
// dropped, and one of that body begun. False when the map goes on.
bool Tracker::Impl::turn_to_other_body(const TrackingMap& map, const Frame& frame, FrameReport* report) {
  constexpr int kMostLeft = 2;  // of a head, the shoulders below it and the room behind
  if (pace_ != SearchPace::kLive || !map.turning_object || bodies_left_ >= kMostLeft) return false;
  if (options_.localize_only || has_earlier_frames(map)) return false;
  const int left = bodies_left_ + 1;
  const bool begins_anew = others_.empty();
  if (begins_anew) {
    begin_anew();
  } else if (!go_back_to(others_.rbegin()->first, false)) {
    return false;
  }
  bodies_left_ = left;
  body_.emplace(*map.turning_object);
  const Frame of_body = followed(frame, report);
  if (begins_anew) {
    const StageTimer timer(report->stages, "bootstrap");
    bootstrap(of_body, report);
  } else {
    frames_lost_ = options_.young_map_patience - 1;
    show_features(frame, report);
    lose(frame, of_body, report);
  }
  report->reason_text = map.doubt + ", and is dropped: " + report->reason_text;
  return true;
}

// By the features of the body that turns where it is followed. By all of the frame's where there is none,
// where it was taken for something else or has been lost: then what the frame is posed by says where the body
// is. map: becomes the one that it was found in, where that is another.
ResectionReport Tracker::Impl::locate(const Frame& frame, TrackingMapPtr* map, Frame* of_body,
                                      FrameReport* report) {
  const StageTimer timer(report->stages, "resect");
  ResectionReport resection;
  if (frames_lost_ == 0 && of_body->whole) resection = follow(*of_body, **map);
  if (resection.success) return resection;
  if (frames_lost_ == 0) {
    resection = follow(frame, **map);
  } else if (tentative_) {
    confirm(frame, map, &resection);
  }
  if (!body_) return resection;
  show_features(frame, report);
  if (!resection.success) return resection;
  const Frame settled = body_->settle(camera_, frame, pixels_of(frame, resection));
  const ResectionReport again = resector_.resect(
      settled, **map, choose_reference(**map, resection, frames_lost_ == 0 ? Among::kNear : Among::kAll),
      resection.camera_from_map);
  *of_body = again.success ? settled : frame;
  show_features(*of_body, report);
  return again.success ? again : resection;
}

}  // namespace mono_pose_tracker
