#include "pipeline/recording_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mapping/keyframe_landmarks.h"
#include "object_masks.h"
#include "recording_reader.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {

namespace {

constexpr RecordingPipelineOptions kPipeline{};

bool shows(OtherObject other, const RecordingResult& result) {
  return result.tracked && result.maps.front().other_object == other;
}

// Masks of the motion independent of the result's map, within its own masks.
std::shared_ptr<const ObjectMasks> masks_of_other_object(const TrackedRecording& tracked) {
  return std::make_shared<ObjectMasks>(tracked.result.maps.front().independent_motion.tracks,
                                       tracked.object_masks);
}

// Number of landmark observations in all images of the first map.
double observations_of(const RecordingResult& result) {
  return static_cast<double>(count_observations(result.maps.front().map));
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

}  // namespace

RecordingPipeline::RecordingPipeline(Recording recording, const TrackerOptions& options,
                                     RecordingCamera camera, ObserverOfAttempt observer_of)
    : recording_(std::move(recording)),
      options_(options),
      given_(std::move(camera)),
      observer_of_(std::move(observer_of)) {
  refinement_.loss_width = options.bundle.loss_width;
  refinement_.num_threads = options.bundle.num_threads;
  refinement_.cancel = recording_.interrupted;
  if (recording_.loaded) given_.is_to_be_refined = false;  // the maps are of other cameras, too
  if (!recording_.loaded && !given_.is_to_be_refined)
    recording_.calibration_test = CalibrationTest{refinement_, given_.parameters};
}

TrackedRecording RecordingPipeline::run() {
  const auto reconstruct = [this](const CameraParameters& camera, int max_keyframes) -> const Map* {
    begin_with(camera);
    kept_ = track(0, nullptr, max_keyframes);
    if (max_keyframes == 0 && !recording_.loaded && kept_.result.frames_total >= 2) {
      const bool is_masked = exclude_background();
      const bool is_switched = switch_to_larger_object() || switch_to_rotating_object();
      // An object larger than the one that rotates more begins the map from any seed.
      const bool may_be_helped = !shows(OtherObject::kRotatesMore, kept_.result);
      if (!is_masked && !is_switched && is_in_doubt() && may_be_helped) try_seeds(1, nullptr);
    }
    return kept_.result.tracked ? &kept_.tracker->map() : nullptr;
  };
  if (given_.is_to_be_refined) {
    kept_.calibration = calibrate_by_tracking(given_.parameters, given_.source, refinement_, reconstruct);
  } else {
    reconstruct(given_.parameters, 0);
    kept_.calibration.camera = given_.parameters;
    kept_.calibration.source = given_.source;
  }
  report_calibration();
  return std::move(kept_);
}

void RecordingPipeline::begin_with(const CameraParameters& camera) {
  kept_ = TrackedRecording();  // two maps need not be held
  camera_ = camera;
  attempts_ = 0;
  recording_.features = std::make_shared<FeatureMemory>(recording_.feature_memory);
}

// Tracks from this share of the recording on; the images before are registered in the end. max_keyframes:
// keyframes with which the map suffices to refine the camera; 0: tracks the whole recording.
TrackedRecording RecordingPipeline::track(double seed, const Masks& masks, int max_keyframes) {
  TrackedRecording made;
  made.attempt = max_keyframes > 0 ? kBeginning : attempts_++;
  made.object_masks = masks;
  made.tracker = make_tracker(options_, camera_, recording_.loaded);
  if (masks) made.tracker->impl().expect_object();
  made.observer = observer_of_(made.attempt);
  Recording recording = recording_;
  recording.first_tracked = static_cast<std::int64_t>(seed * static_cast<double>(kept_.result.frames_total));
  recording.object_masks = masks;
  std::atomic<bool> has_enough{false};
  FrameObserver observer = made.observer;
  if (max_keyframes > 0) {
    recording.features = nullptr;
    recording.interrupted = [&] { return has_enough || recording_.interrupted(); };
    observer = [&](int pass, std::int64_t index, const FrameReport& report) {
      made.observer(pass, index, report);
      if (report.keyframes >= max_keyframes) has_enough = true;
    };
  }
  made.result = track_recording(recording, observer, made.tracker.get());
  return made;
}

// Tracks from these seeds, starting with first_index, until a result is confirmed. Returns whether one of the
// results is kept.
bool RecordingPipeline::try_seeds(std::size_t first_index, const Masks& masks) {
  bool is_kept = false;
  for (std::size_t i = first_index; i < kPipeline.seeds.size() && !recording_.interrupted(); ++i) {
    TrackedRecording next = track(kPipeline.seeds[i], masks);
    if (is_better(next.result, kept_.result)) {
      kept_ = std::move(next);
      is_kept = true;
    }
    if (!is_in_doubt()) break;
  }
  return is_kept;
}

// Where the tracked object is in doubt, or nothing was tracked: tests the whole recording for motion in front
// of a static background. If there is any, the recording is tracked with masks of the moving object. Returns
// whether a map with these masks is kept.
bool RecordingPipeline::exclude_background() {
  Tracker::Impl& tracker = kept_.tracker->impl();
  if (is_confirmed(kept_.result) || recording_.masks || !tracker.may_have_background() ||
      recording_.interrupted())
    return false;
  const std::int64_t total = kept_.result.frames_total;
  const std::int64_t step =
      std::max<std::int64_t>(1, (total + kPipeline.sampled_images - 1) / kPipeline.sampled_images);
  std::set<std::int64_t> sampled;
  for (std::int64_t index = 0; index < total; index += step) sampled.insert(index);
  std::vector<SeenImage> images;
  read_again(recording_, kept_.result, tracker, sampled, [&](const RecordingReader& reader) {
    const ImageFeaturesPtr features = tracker.features_of(reader.prepared());
    if (features) images.push_back({reader.index(), features});
  });
  const StaticBackground background = tracker.background_of(images);
  if (!background.exists) return false;
  const Masks masks = std::make_shared<ObjectMasks>(background.tracks, nullptr);
  return !masks->are_empty() && try_seeds(0, masks);
}

// Where the map is of an object smaller than the independent motion, and no masks choose one: tracks the
// recording again with masks of the other object. Returns whether that is larger indeed, and kept.
bool RecordingPipeline::switch_to_larger_object() {
  const RecordingResult& first = kept_.result;
  if (!shows(OtherObject::kLarger, first) || recording_.masks) return false;
  const double larger_share = first.maps.front().independent_motion.share();
  const Masks masks = masks_of_other_object(kept_);
  for (const double seed : kPipeline.seeds) {
    if (!can_track_with(masks)) return false;
    TrackedRecording found = track(seed, masks);
    if (!is_right_of_its_object(found.result) || !is_most_of(found.result, first) ||
        observations_of(found.result) < kPipeline.plainly_larger * observations_of(first)) {
      continue;
    }
    kept_ = std::move(found);
    report_smaller_object(1 - larger_share);
    return true;
  }
  return false;
}

// Where the map is of an object that rotates less than another one: tracks the recording again with masks of
// the independent motion, from each seed. A head and shoulders that move together for a while give a map of
// both when it begins there. Returns whether a map of the rotating object is kept.
bool RecordingPipeline::switch_to_rotating_object() {
  const RecordingResult& first = kept_.result;
  if (!shows(OtherObject::kMayBeTurning, first)) return false;
  const Masks others = masks_of_other_object(kept_);
  std::optional<TrackedRecording> best;
  for (const double seed : kPipeline.seeds) {
    const bool is_done = best && is_confirmed(best->result) && is_most_of(best->result, first);
    if (is_done || !can_track_with(others)) break;
    TrackedRecording found = track_most_rotating_object(seed, others);
    if (!is_of_rotating_object(found.result, first)) continue;
    if (!best || is_better(found.result, best->result)) best = std::move(found);
  }
  if (best) kept_ = std::move(*best);
  return best.has_value();
}

// Tracks the recording with these masks, and again with masks of the independent motion until the map is of
// the object that rotates most.
TrackedRecording RecordingPipeline::track_most_rotating_object(double seed, Masks masks) {
  TrackedRecording found = track(seed, masks);
  for (int objects = 2; objects < kPipeline.most_objects && shows(OtherObject::kMayBeTurning, found.result);
       ++objects) {
    masks = masks_of_other_object(found);
    if (!can_track_with(masks)) break;
    found = track(seed, masks);
  }
  return found;
}

bool RecordingPipeline::is_in_doubt() const {
  return !is_confirmed(kept_.result) || fell_apart(kept_.result);
}

bool RecordingPipeline::can_track_with(const Masks& masks) const {
  return !masks->are_empty() && !recording_.interrupted();
}

// The other object could be the wanted one. Results with these masks do not contain it.
void RecordingPipeline::report_smaller_object(double share) {
  if (share <= MotionSegmentationOptions().comparable) return;
  const std::string text =
      "Two rigid objects move, and the map is of the larger: " + std::to_string(std::lround(100 * share)) +
      " % of the matches move with the smaller one and are excluded. If that one is wanted, mask it "
      "(--masks).";
  add_finding(FindingKind::kOtherObject, text, true, &kept_.result);
}

// The warnings of a refinement. A camera that was not refined is tested against the map. Evidence against the
// camera is evidence against every map: none of them is confirmed.
void RecordingPipeline::report_calibration() {
  const SelfCalibration& calibration = kept_.calibration;
  const auto report = [this](const std::string& text, bool is_disqualifying = true) {
    add_finding(FindingKind::kCalibration, text, is_disqualifying, &kept_.result);
  };
  for (const std::string& warning : calibration.warnings) report(warning, !calibration.is_near);
  if (!kept_.result.tracked) return;
  if (calibration.source != CalibrationSource::kRefined && !recording_.loaded) {
    const std::optional<std::string>& known = kept_.result.calibration_doubt;
    const std::string doubt =
        known ? *known : doubt_of_calibration(refinement_, calibration.camera, kept_.tracker->map());
    if (!doubt.empty()) report(doubt);
  }
  if (calibration.source == CalibrationSource::kGuessed) {
    report(
        "the guessed focal length is not confirmed: path and map may be distorted; calibrate the camera, or "
        "record rotations and views from more sides");
  }
}

std::unique_ptr<Tracker> make_tracker(const TrackerOptions& options, const CameraParameters& camera,
                                      const SavedMaps* loaded) {
  auto made = std::make_unique<Tracker>(options, CameraModel(camera), Tracker::Mapping::kInline);
  if (loaded) made->load_maps(*loaded);
  return made;
}

}  // namespace mono_pose_tracker
