// Tracks the camera image by image: begins a map, tracks in it, loses it.

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/tracking/options_table.h"
#include "tracker_impl.h"
#include "tracking/load_governor.h"

namespace mono_pose_tracker {

std::optional<Frame> Tracker::Impl::make_frame(std::int64_t index, std::int64_t stamp_ns,
                                               const PreparedImage& image, const Segmentation& segmentation,
                                               FrameReport* report) {
  // The search takes time, and a map with a scale keeps it.
  const bool looks_for_marker =
      state_ == State::kBootstrapping || (scale_ == ScaleSource::kMapUnits && !options_.localize_only);
  std::optional<Frame> frame =
      frame_maker_.make(index, stamp_ns, image, segmentation, object_finder_.clearance(segmentation.mask),
                        looks_for_marker, report);
  if (!frame) return frame;
  frame->is_of_object = frame->is_masked && (expects_object_ || segmentation.is_by_motion());
  frame->is_mask_given = segmentation.method == Segmentation::kGivenMask && !expects_object_;
  return frame;
}

FrameReport Tracker::Impl::process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask) {
  FrameReport report;
  report.stamp_ns = stamp_ns;
  const std::int64_t index = next_index_++;
  std::optional<Frame> frame;
  if (frame_maker_.has_camera_size(image.image, &report)) {
    Segmentation segmentation;
    {
      const StageTimer timer(report.stages, "segment");
      const bool may_begin = state_ != State::kTracking && !options_.localize_only;
      segmentation = object_finder_.find(image.image, mask, may_begin, is_of_motion_now());
    }
    frame = make_frame(index, stamp_ns, image, segmentation, &report);
  }
  if (!frame || frame->image->size() == 0) ++frames_excluded_;
  if (frame) {
    if (state_ == State::kBootstrapping && options_.localize_only) {
      report.reason = Reason::kRelocalising;
      report.reason_text = "there is no map, and localize_only does not start one: load a map";
    } else if (state_ == State::kBootstrapping) {
      const Frame of_object = followed(*frame, &report);
      const StageTimer timer(report.stages, "bootstrap");
      bootstrap(of_object, &report);
    } else {
      track(*frame, &report);
    }
  }
  finish_report(&report);
  return report;
}

// Whether the tracked or searched map is that of the object found by motion.
bool Tracker::Impl::is_of_motion_now() const {
  return motion_map_ == present_map_ && (state_ == State::kTracking || others_.empty());
}

void Tracker::Impl::finish_report(FrameReport* report) {
  report->state = state_;
  report->epoch = epoch_;
  report->load_level = std::max(load_level_, static_cast<int>(kFullWork));
  report->worker_backlog = worker_.unfinished_jobs();
  report->length_scale = std::exchange(length_scale_, 1.0);
  if (const TrackingMapPtr map = worker_.latest()) {
    report->keyframes = static_cast<int>(map->keyframes.size());
    report->landmarks = static_cast<int>(map->landmarks.size());
    // The map in which the frame was registered; later corrections belong to the next frame.
    report->map_id = present_map_;
    for (const auto& entry : others_) report->inactive_maps.push_back(entry.first);
    const auto corrected = times_corrected_.find(present_map_);
    if (corrected != times_corrected_.end()) report->corrections = corrected->second;
    if (!is_corrected_since(*map)) scale_ = map->scale_source;
    report->scale = scale_;
    report_corrections(*map, report);
    if (report->map_from_camera && report->reason == Reason::kOk && !map->doubt.empty()) {
      report->reason = Reason::kNotRigid;
      report->reason_text = map->doubt;
    }
    if (std::exchange(reported_revision_, map->revision) != map->revision) {
      report->stages.insert(report->stages.end(), map->stages.begin(), map->stages.end());
    }
  }
}

// Whether the unit has changed since the frame was registered.
bool Tracker::Impl::is_corrected_since(const TrackingMap& map) const {
  return std::any_of(map.corrections.begin(), map.corrections.end(), [this](const auto& correction) {
    return correction->of_map == present_map_ && correction->sequence > corrections_;
  });
}

// Reports the poses of the map's frames after they were corrected.
void Tracker::Impl::report_corrections(const TrackingMap& map, FrameReport* report) {
  const std::pair<std::uint32_t, std::uint64_t> now(present_map_, corrections_);
  if (now == reported_ || map.map_id != present_map_ || is_corrected_since(map)) return;
  if (reported_.first != 0) report->corrected = trajectory_in(map, frames_[present_map_]);
  reported_ = now;
}

// Continues in the map that the worker has begun.
void Tracker::Impl::start_map() {
  const TrackingMapPtr map = worker_.latest();
  for (const auto& [id, keyframe] : map->keyframes) {
    std::vector<FrameObservation> observations;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId landmark = keyframe.landmark_of_feature[f];
      if (landmark != kNoLandmark) observations.push_back({static_cast<int>(f), landmark});
    }
    // If the keyframe is removed, its image stays registered.
    frames_[map->map_id].set(keyframe.frame_index, {keyframe.stamp_ns, id, Rigid3(),
                                                    pixels_of_landmarks(*keyframe.image, observations)});
  }
  present_map_ = map->map_id;
  reference_ = map->keyframes.rbegin()->first;
  camera_from_reference_ = Rigid3();
  motion_.reset();
  end_loss();
  state_ = State::kTracking;
}

void Tracker::Impl::bootstrap(const Frame& frame, FrameReport* report) {
  // Threaded, the frames since the known one were ignored.
  if (std::optional<BootstrapReport> known = bootstrap_job_.add(frame, epoch_, true, &worker_))
    bootstrap_ = std::move(*known);
  report->reason = bootstrap_.reason;
  report->reason_text = bootstrap_.text;
  report->matches = bootstrap_.matches;
  report->inliers = bootstrap_.inliers;
  report->median_parallax_deg = bootstrap_.median_parallax_deg;
  report->motions = bootstrap_.motions;
  if (!bootstrap_.is_begun) return;
  const RegistrationReport registration =
      begin_in_new_map(frame, std::exchange(bootstrap_, BootstrapReport()), report);
  if (registration.success) return;
  begin_anew();
  report->reason = registration.reason;
  report->reason_text = "the new map is not confirmed: " + registration.text;
}

// Registers the frame in the new map, for its covariance and all points of the map.
RegistrationReport Tracker::Impl::begin_in_new_map(const Frame& frame, const BootstrapReport& bootstrap,
                                                   FrameReport* report) {
  start_map();
  const TrackingMapPtr map = worker_.latest();
  const KeyframeView& newest = map->keyframes.at(reference_);
  RegistrationReport registration =
      registrar_.register_frame(frame, *map, reference_, newest.camera_from_map);
  if (!registration.success) return registration;
  // For a frame out of order, the motion mask has seen another image last.
  if (frame.index + 1 == next_index_ && !bootstrap.static_background.empty()) {
    motion_map_ = present_map_;
    object_finder_.start(bootstrap, frame, registration);
  }
  describe(registration, report);
  report->reason_text = bootstrap.text;
  report->is_keyframe = newest.frame_index == frame.index;
  if (report->is_keyframe) return registration;
  camera_from_reference_ = registration.camera_from_map * newest.camera_from_map.inverse();
  frames_[map->map_id].set(frame.index, {frame.stamp_ns, reference_, camera_from_reference_,
                                         pixels_of_landmarks(*frame.image, registration.observations)});
  return registration;
}

void Tracker::Impl::describe(const RegistrationReport& registration, FrameReport* report) const {
  report->reason = registration.reason;
  report->reason_text = registration.text;
  report->matches = registration.matches;
  report->inliers = registration.inliers;
  report->reprojection_rms_px = registration.rms_px;
  report->motions.clear();
  for (const int f : registration.matched) report->seen[f].fate = SeenFeature::Fate::kOutlier;
  for (const FrameObservation& o : registration.observations) {
    report->seen[o.feature].fate = SeenFeature::Fate::kInlier;
    report->seen[o.feature].landmark = o.landmark;
  }
  if (!registration.success) return;
  report->map_from_camera = registration.camera_from_map.inverse();
  report->covariance = registration.covariance + registration.map_covariance;
  report->map_covariance = registration.map_covariance;
}

// camera_from_map of the last registered frame.
std::optional<Rigid3> Tracker::Impl::last_pose(const TrackingMap& map) const {
  Rigid3 reference_from_map;
  if (!map.camera_from_map(reference_, &reference_from_map)) return std::nullopt;
  return camera_from_reference_ * reference_from_map;
}

// Registers against the landmarks near the last pose.
RegistrationReport Tracker::Impl::follow(const Frame& frame, const TrackingMap& map) const {
  const std::optional<Rigid3> last = last_pose(map);
  if (!last) return {};
  return registrar_.register_frame(frame, map, living_ancestor(map.removed_keyframes, reference_),
                                   motion_ ? *motion_ * *last : *last);
}

// Uses one view of the map: later changes by the worker have another unit and belong to the next frame.
void Tracker::Impl::track(const Frame& frame, FrameReport* report) {
  TrackingMapPtr map = worker_.latest();
  apply_corrections(*map);
  forget_dropped_maps(*map);
  if (switch_to_other_object(*map, frame, report)) return;
  Frame of_object = followed(frame, report);
  const RegistrationReport registration = locate(frame, &map, &of_object, report);
  describe(registration, report);
  if (registration.success && accept(of_object, *map, registration, report)) {
    choose_masks(frame, *map, registration.camera_from_map);
    return;
  }
  lose(frame, of_object, report);
}

void Tracker::Impl::lose(const Frame& frame, const Frame& of_object, FrameReport* report) {
  state_ = State::kLost;
  motion_.reset();
  ++frames_lost_;
  const bool found = search(frame, report);
  if (frames_lost_ > 1 || found) {
    // This is not the image of the loss: the reason is that none of the compared keyframes fits, or that too
    // many do.
    if (report->reason != Reason::kAmbiguousPose) report->reason = Reason::kRelocalising;
    report->reason_text = "lost for " + std::to_string(frames_lost_) + " images: " + report->reason_text;
  }
  if (found || frames_lost_ < options_.young_map_patience || options_.localize_only) return;
  const TrackingMapPtr map = worker_.latest();
  if (static_cast<int>(map->keyframes.size()) <= options_.young_map_keyframes && !has_earlier_frames(*map)) {
    drop_young_map(report);
  } else {
    if (object_follower_) show_features(of_object, report);
    bootstrap_additional(of_object, report);
  }
}

void Tracker::Impl::wait() {
  worker_.wait();
  if (const TrackingMapPtr map = worker_.latest()) apply_corrections(*map);
}

void Tracker::Impl::reset() {
  begin_anew();
  objects_abandoned_ = 0;
  object_follower_.reset();
}

// The choice of the object to be mapped is kept.
void Tracker::Impl::begin_anew() {
  ++epoch_;
  worker_.reset(epoch_);
  bootstrap_ = BootstrapReport();
  object_finder_.reset();
  frames_.clear();
  others_.clear();
  tentative_.reset();
  present_map_ = 0;
  reported_ = {};
  state_ = State::kBootstrapping;
  reference_ = -1;
  camera_from_reference_ = Rigid3();
  motion_.reset();
  keyframe_policy_.reset();
  innovation_gate_.reset();
  end_loss();
  rests_on_two_views_ = false;
  sessions_.clear();
}

void Tracker::Impl::set_options(const TrackerOptions& options) {
  copy_changeable(options, &given_options_);
  apply_options();
}

// Time to spare: twice the usual number of strongest features, and a lower detection threshold for them.
void Tracker::Impl::set_load_level(int level) {
  if (std::exchange(load_level_, level) != level) apply_options();
}

void Tracker::Impl::apply_options() {
  options_ = given_options_.for_images({camera_.width(), camera_.height()}, pace_, load_level_)
                 .cancellable(&cancelled_);
  object_finder_.set_options(options_.segmentation);
  frame_maker_.set_options(options_.sift, options_.segmentation);
  registrar_ = FrameRegistrar(options_, camera_);
  keyframe_policy_.set_options(options_.mapping, options_.young_map_keyframes);
  bootstrap_job_.set_options(options_);
  worker_.set_options(options_.mapper(camera_.focal()));
}

std::vector<RegisteredFrame> Tracker::Impl::trajectory() const {
  const TrackingMapPtr map = worker_.latest();
  if (!map) return {};
  const auto frames = frames_.find(map->map_id);
  return frames == frames_.end() ? std::vector<RegisteredFrame>() : trajectory_in(*map, frames->second);
}

}  // namespace mono_pose_tracker
