// Tracks a recording more than once, from other seeds or with other masks.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/static_background.h"
#include "object_masks.h"
#include "pipeline/recording.h"
#include "recording_reader.h"
#include "result_choice.h"
#include "tracking/feature_memory.h"

namespace mono_pose_tracker {

namespace {

// Counts the runs.
class Attempts {
 public:
  Attempts(const TrackerMaker& make_tracker, const ObserverOfAttempt& observer_of,
           const AttemptOptions& options)
      : make_tracker_(make_tracker), observer_of_(observer_of), options_(options) {}

  const AttemptOptions& options() const { return options_; }

  TrackedRecording next(const Recording& recording) {
    TrackedRecording made;
    made.attempt = count_++;
    made.tracker = make_tracker_();
    if (recording.object_masks) made.tracker->expect_object();
    made.observer = observer_of_(made.attempt);
    made.result = track_recording(recording, made.observer, made.tracker.get());
    return made;
  }

 private:
  const TrackerMaker& make_tracker_;
  const ObserverOfAttempt& observer_of_;
  const AttemptOptions& options_;
  int count_ = 0;
};

bool is_of_other_object(const RecordingResult& result) {
  return result.tracked && result.maps.front().is_of_other_object;
}

bool is_of_smaller_object(const RecordingResult& result) {
  return result.tracked && result.maps.front().is_of_smaller_object;
}

StaticBackground background_of(const Recording& recording, const RecordingResult& result,
                               std::int64_t sampled_images, Tracker* tracker) {
  const std::int64_t step =
      std::max<std::int64_t>(1, (result.frames_total + sampled_images - 1) / sampled_images);
  std::vector<SeenImage> images;
  read_again(
      recording, result, *tracker, [&](std::int64_t index) { return index % step == 0; },
      [&](const RecordingReader& reader) {
        const ImageFeaturesPtr features = tracker->features_of(reader.prepared());
        if (features) images.push_back({reader.index(), features});
      });
  return tracker->background_of(images);
}

// Where the tracked object is in doubt, or nothing was tracked: tests the whole recording for motion in front
// of a static background. If there is any, the recording is tracked with masks of the moving object from then
// on.
bool exclude_background(const AttemptOptions& options, const TrackedRecording& first, Recording* recording) {
  if (is_confirmed(first.result)) return false;
  if (recording->masks || !first.tracker->may_have_background() || recording->interrupted()) return false;
  const StaticBackground background =
      background_of(*recording, first.result, options.sampled_images, first.tracker.get());
  if (!background.exists) return false;
  auto masks = std::make_shared<ObjectMasks>(background.tracks, nullptr);
  if (masks->are_empty()) return false;
  recording->object_masks = std::move(masks);
  return true;
}

// Number of landmark observations in all images of the first map.
double observations_of(const RecordingResult& result) {
  std::size_t count = 0;
  for (const auto& entry : result.maps.front().map.landmarks()) {
    count += entry.second.observations.size();
  }
  return static_cast<double>(count);
}

std::int64_t frame_at(double share, const RecordingResult& result) {
  return static_cast<std::int64_t>(share * static_cast<double>(result.frames_total));
}

// The recording with masks of the motion independent of the result's map.
Recording within_other_object(Recording recording, const RecordingResult& result) {
  recording.object_masks =
      std::make_shared<ObjectMasks>(result.maps.front().independent_motion.tracks, recording.object_masks);
  return recording;
}

bool can_be_tracked(const Recording& masked) {
  return !masked.object_masks->are_empty() && !masked.interrupted();
}

// Tracks the recording with its masks, and again with masks of the independent motion until the map is of the
// object that rotates most.
TrackedRecording track_most_rotating_object(Attempts* attempts, Recording* masked) {
  TrackedRecording found = attempts->next(*masked);
  for (int objects = 2; objects < attempts->options().most_objects && is_of_other_object(found.result);
       ++objects) {
    Recording within = within_other_object(*masked, found.result);
    if (!can_be_tracked(within)) break;
    *masked = std::move(within);
    found = attempts->next(*masked);
  }
  return found;
}

// With three objects the map may be of two at once, so most of the images must show it; half of them where
// there is no contradiction.
bool is_seen_enough(const RecordingResult& result, const RecordingResult& first) {
  if (is_most_of(result, first)) return true;
  return is_right_of_its_object(result) && 2 * result.trajectory.size() >= first.trajectory.size();
}

// Whether the object plainly rotates farther than the first.
bool is_of_rotating_object(const RecordingResult& result, const RecordingResult& first) {
  if (!result.tracked || !is_seen_enough(result, first)) return false;
  return rotation_before_cameras(result.maps.front().map) >=
         MotionSegmentationOptions().plainly_rotates * rotation_before_cameras(first.maps.front().map);
}

// Where the map is of an object that rotates less than another one: tracks the recording again with masks of
// the independent motion, from each seed. A head and shoulders that move together for a while give a map of
// both when it begins there. Returns whether a map of the rotating object is kept, and its masks with it.
bool switch_to_other_object(Attempts* attempts, Recording* recording, TrackedRecording* kept) {
  const RecordingResult& first = kept->result;
  const Recording others = within_other_object(*recording, first);
  std::optional<TrackedRecording> best;
  for (const double beginning : attempts->options().seeds) {
    const bool is_done = best && is_confirmed(best->result) && is_most_of(best->result, first);
    if (is_done || !can_be_tracked(others)) break;
    Recording masked = others;
    masked.first_tracked = frame_at(beginning, first);
    TrackedRecording found = track_most_rotating_object(attempts, &masked);
    if (!is_of_rotating_object(found.result, first)) continue;
    if (best && !is_better(found.result, best->result)) continue;
    *recording = std::move(masked);
    best = std::move(found);
  }
  if (!best) return false;
  *kept = std::move(*best);
  return true;
}

// The other object could be the wanted one.
void report_smaller_object(double share, RecordingResult* result) {
  if (share <= MotionSegmentationOptions().comparable) return;
  result->maps.front().may_be_of_wrong_object = true;
  Finding finding;
  finding.kind = FindingKind::kOtherObject;
  finding.text =
      "Two rigid objects move, and the map is of the larger: " + std::to_string(std::lround(100 * share)) +
      " % of the matches move with the other and are excluded. Mask that one if it is wanted (--masks).";
  add_finding(std::move(finding), result);
}

// Where the map is of an object smaller than the independent motion, and no masks choose one: tracks the
// recording again with masks of the other object. If that is larger indeed, the result and its masks are
// kept, and the share of the smaller object is returned.
std::optional<double> switch_to_larger_object(Attempts* attempts, Recording* recording,
                                              TrackedRecording* kept) {
  const double larger_share = kept->result.maps.front().independent_motion.share();
  if (recording->masks) return std::nullopt;
  Recording masked = within_other_object(*recording, kept->result);
  for (const double beginning : attempts->options().seeds) {
    if (!can_be_tracked(masked)) return std::nullopt;
    masked.first_tracked = frame_at(beginning, kept->result);
    TrackedRecording found = attempts->next(masked);
    if (!is_right_of_its_object(found.result) || !is_most_of(found.result, kept->result) ||
        observations_of(found.result) < attempts->options().plainly_larger * observations_of(kept->result)) {
      continue;
    }
    *recording = std::move(masked);
    *kept = std::move(found);
    return 1 - larger_share;
  }
  return std::nullopt;
}

// Tracks from these seeds, starting with first_index, until a result is confirmed. Returns whether one of the
// results is kept.
bool try_other_seeds(Attempts* attempts, std::size_t first_index, Recording recording,
                     TrackedRecording* kept) {
  bool is_kept = false;
  const auto& seeds = attempts->options().seeds;
  for (std::size_t i = first_index; i < seeds.size() && !recording.interrupted(); ++i) {
    recording.first_tracked = frame_at(seeds[i], kept->result);
    TrackedRecording next = attempts->next(recording);
    if (is_better(next.result, kept->result)) {
      *kept = std::move(next);
      is_kept = true;
    }
    if (is_confirmed(kept->result) && !fell_apart(kept->result)) break;
  }
  return is_kept;
}

}  // namespace

TrackedRecording track_until_confirmed(const Recording& as_given, const TrackerMaker& make_tracker,
                                       const ObserverOfAttempt& observer_of, const AttemptOptions& options) {
  Attempts attempts(make_tracker, observer_of, options);
  Recording recording = as_given;
  recording.features = std::make_shared<FeatureMemory>(recording.feature_memory);
  TrackedRecording kept = attempts.next(recording);
  const bool may_have_map = kept.result.frames_total >= 2;
  if (!recording.try_again || !may_have_map) return kept;
  Recording again = recording;
  const bool is_by_masks =
      exclude_background(options, kept, &again) && try_other_seeds(&attempts, 0, again, &kept);
  if (!is_by_masks) again = recording;
  std::optional<double> smaller_share;
  if (is_of_smaller_object(kept.result)) smaller_share = switch_to_larger_object(&attempts, &again, &kept);
  bool is_of_another = smaller_share.has_value();
  if (is_of_other_object(kept.result) && switch_to_other_object(&attempts, &again, &kept))
    is_of_another = true;
  if (!is_by_masks && !is_of_another && (!is_confirmed(kept.result) || fell_apart(kept.result)))
    try_other_seeds(&attempts, 1, again, &kept);
  // Results with these masks do not contain it.
  if (smaller_share) report_smaller_object(*smaller_share, &kept.result);
  return kept;
}

}  // namespace mono_pose_tracker
