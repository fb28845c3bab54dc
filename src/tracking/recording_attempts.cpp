// A recording that is tracked more than once.

#include <array>
#include <memory>
#include <utility>

#include "body_masks.h"
#include "mono_pose_tracker/mapping/depth_reversal.h"
#include "mono_pose_tracker/tracking/recording.h"

namespace mono_pose_tracker {

bool is_sure(const RecordingResult& result) {
  return !result.tracked || (result.rigidity.is_rigid && result.maps.front().is_sure());
}

bool is_confirmed(const RecordingResult& result) {
  return result.tracked && result.rigidity.is_rigid && result.maps.front().confirmed;
}

namespace {

// An object that is lost while it turns is often found again from another beginning; its recordings are
// short.
bool fell_apart(const RecordingResult& result) {
  return result.tracked && result.maps.size() > 1 && is_narrow(result.maps.front().map);
}

bool is_enough(const RecordingResult& result) { return is_sure(result) && !fell_apart(result); }

// A sure piece of the recording is no better answer than most of it with a warning.
bool is_most_of(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMinShare = 0.75;
  return static_cast<double>(result.trajectory.size()) >=
         kMinShare * static_cast<double>(before.trajectory.size());
}

// What takes the place of another must be better founded, or as well and longer.
bool is_better(const RecordingResult& result, const RecordingResult& before) {
  if (!is_confirmed(result)) return false;
  return is_sure(before) ? result.trajectory.size() > before.trajectory.size() : is_most_of(result, before);
}

// Counts them.
class Attempts {
 public:
  Attempts(const TrackerMaker& make_tracker, const ObserverOfAttempt& observer_of)
      : make_tracker_(make_tracker), observer_of_(observer_of) {}

  TrackedRecording next(const Recording& recording) {
    TrackedRecording made;
    made.attempt = count_++;
    made.tracker = make_tracker_();
    made.result = track_recording(recording, observer_of_(made.attempt), made.tracker.get());
    return made;
  }

 private:
  const TrackerMaker& make_tracker_;
  const ObserverOfAttempt& observer_of_;
  int count_ = 0;
};

bool is_of_other_body(const RecordingResult& result) {
  return result.tracked && result.maps.front().is_of_other_body;
}

// Where the map is of a body that turns less than another: the recording again, by masks of all that moves
// otherwise than the map, until the map is of what turns most. It is kept, with the masks, where it plainly
// turns farther than the first, and most of the images show it: of three bodies it may be two at once.
void turn_to_other_body(Attempts* attempts, Recording* recording, TrackedRecording* kept) {
  constexpr int kMostBodies = 3;  // a head, the shoulders below it, the room behind
  Recording masked = *recording;
  TrackedRecording found;
  const RecordingResult* result = &kept->result;
  for (int bodies = 1; bodies < kMostBodies && is_of_other_body(*result); ++bodies) {
    masked.body = std::make_shared<BodyMasks>(result->maps.front().other_body.tracks, masked.body);
    if (masked.body->are_empty() || masked.interrupted()) return;
    found = attempts->next(masked);
    result = &found.result;
    if (!result->tracked) return;
  }
  if (!is_most_of(*result, kept->result)) return;
  const double turn = turn_before_cameras(result->maps.front().map);
  if (turn < OtherBody::kPlainly * turn_before_cameras(kept->result.maps.front().map)) return;
  *recording = std::move(masked);
  *kept = std::move(found);
}

}  // namespace

TrackedRecording track_until_sure(const Recording& recording, const TrackerMaker& make_tracker,
                                  const ObserverOfAttempt& observer_of) {
  constexpr std::array<double, 3> kOtherBeginnings = {0.5, 0.25, 0.75};  // as far from one another as can be
  Attempts attempts(make_tracker, observer_of);
  TrackedRecording kept = attempts.next(recording);
  if (!recording.try_again) return kept;
  Recording again = recording;
  if (is_of_other_body(kept.result)) turn_to_other_body(&attempts, &again, &kept);
  for (const double beginning : kOtherBeginnings) {
    if (is_enough(kept.result) || recording.interrupted()) break;
    again.first_tracked =
        static_cast<std::int64_t>(beginning * static_cast<double>(kept.result.frames_total));
    TrackedRecording next = attempts.next(again);
    if (is_better(next.result, kept.result)) kept = std::move(next);
  }
  return kept;
}

}  // namespace mono_pose_tracker
