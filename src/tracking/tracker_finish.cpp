// The end of a recording: merges, finishes and assesses maps, and looks for a static background.

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "mapping/depth_reversal.h"
#include "mapping/in_view.h"
#include "mapping/planar_ambiguity.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

bool Tracker::Impl::finish() {
  worker_.wait();
  if (state_ == State::kBootstrapping) {
    if (options_.localize_only) return false;
    const std::optional<BootstrapReport> known = bootstrap_job_.take(epoch_);
    if (!known || !known->is_begun) {
      if (next_index_ - frames_excluded_ != 2) return false;
      const BootstrapReport two_views = bootstrap_job_.bootstrapper().unconfirmed();
      if (!two_views.map) return false;
      worker_.begin(epoch_, [&](Mapper& mapper) { mapper.initialize(*two_views.map, epoch_); });
      rests_on_two_views_ = true;
    }
    start_map();
  }
  if (!options_.localize_only) {
    merge_and_finish();
  } else if (!others_.empty()) {
    resume_largest();
  }
  return true;
}

// Merges maps that can be aligned; completes and adjusts the largest.
void Tracker::Impl::merge_and_finish() {
  if (!others_.empty()) {
    worker_.mapper().join_rest();
    follow_mapper();
    resume_largest();
  }
  worker_.mapper().finish();
  follow_mapper();
}

// The map with most registered frames becomes the present one; of equals, the oldest.
void Tracker::Impl::resume_largest() {
  const std::vector<std::uint32_t> ids = all_maps();
  show(*std::max_element(ids.begin(), ids.end(),
                         [&](auto a, auto b) { return frames_[a].size() < frames_[b].size(); }));
  others_.clear();
  for (const std::uint32_t id : worker_.mapper().inactive_maps()) others_[id] = nullptr;
}

// Registers against the keyframes nearest in time, and returns the best result.
RegistrationReport Tracker::Impl::register_near_in_time(const Frame& frame, const TrackingMap& map,
                                                        std::size_t keyframes) const {
  std::vector<std::pair<std::int64_t, KeyframeId>> by_time;
  for (const auto& [id, keyframe] : map.keyframes) {
    by_time.emplace_back(std::abs(keyframe.frame_index - frame.index), id);
  }
  const auto end = by_time.begin() + static_cast<std::ptrdiff_t>(std::min(by_time.size(), keyframes));
  std::partial_sort(by_time.begin(), end, by_time.end());
  RegistrationReport best;
  for (auto nearest = by_time.begin(); nearest != end; ++nearest) {
    RegistrationReport report = registrar_.register_frame(frame, map, nearest->second, std::nullopt);
    if (is_better(report, best)) best = std::move(report);
  }
  return best;
}

std::optional<Frame> Tracker::Impl::make_frame_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                                     const PreparedImage& image, const cv::Mat& mask,
                                                     FrameReport* report) {
  report->stamp_ns = stamp_ns;
  if (!frame_maker_.has_camera_size(image.image, report)) return std::nullopt;
  const TrackingMapPtr map = worker_.latest();
  const bool masks = map && motion_map_ == map->map_id;
  return make_frame(frame_index, stamp_ns, image,
                    object_finder_.find_again(frame_index, image.image, mask, masks), report);
}

FrameReport Tracker::Impl::keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns,
                                          const PreparedImage& image, const cv::Mat& mask) {
  FrameReport report;
  if (auto frame = make_frame_again(frame_index, stamp_ns, image, mask, &report)) {
    unregistered_[frame_index] = std::move(*frame);
  }
  return report;
}

// The registered frames, with all features that were found in them.
std::vector<RegisteredImage> Tracker::Impl::seen_in(const FinishedMap& map) const {
  std::vector<RegisteredImage> seen;
  for (const RegisteredFrame& frame : map.trajectory) {
    if (const ImageFeaturesPtr image = seen_.find(frame.index))
      seen.push_back({frame.index, frame.map_from_camera.inverse(), image});
  }
  return seen;
}

MotionSegmentationOptions Tracker::Impl::motion_options() const {
  return motion_segmentation_options(options_.matching, options_.ransac(camera_.focal()), options_.threads);
}

// Images between the keyframes are compared only where the other object may be the wanted one.
void Tracker::Impl::assess_independent_motion(FinishedMap* map) {
  const MotionSegmentationOptions options = motion_options();
  if (!keeps_seen()) {
    const MotionEvidence other = sample_independent_motion(map->map, {1}, options, &view_graph());
    map->independent_motion = {other, {}};
    if (other.is_larger()) {
      map->other_object = OtherObject::kLarger;
      map->independent_motion =
          find_independent_motion(map->map, {}, ComparedImages::kKeyframes, options, &view_graph());
    } else if (other.is_comparable()) {
      map->other_object = OtherObject::kComparable;
    } else if (!goes_through(map->map)) {
      MotionEvidence slow = other;  // a slow rotation shows between distant keyframes only
      slow += sample_independent_motion(map->map, {2, 4}, options, &view_graph());
      if (slow.exists() && slow.rotates_plainly_more()) map->other_object = OtherObject::kRotatesMore;
    }
    return;
  }
  const std::vector<RegisteredImage> seen = seen_in(*map);
  IndependentMotion other =
      find_independent_motion(map->map, seen, ComparedImages::kKeyframes, options, &view_graph());
  const bool may_be_turning = other.may_exist() && !other.rotates_plainly_less();
  if (other.exists()) map->object_tracks = std::move(other.tracks);
  if (!may_be_turning) return;  // independently moving features are excluded
  map->other_object = OtherObject::kMayBeTurning;
  map->independent_motion =
      find_independent_motion(map->map, seen, ComparedImages::kAllSeen, options, &view_graph());
}

// The present map, not yet assessed.
FinishedMap Tracker::Impl::finished() {
  const TrackingMapPtr view = worker_.latest();
  FinishedMap map;
  map.id = view->map_id;
  map.trajectory = trajectory_in(*view, frames_[view->map_id]);
  map.registered = frames_[view->map_id].landmarks();
  map.map = worker_.mapper().map();
  map.precision = path_precision(map.map);
  map.snapshot = snapshot_of(view);
  worker_.mapper().connect();
  map.explained = explained_matches(map.map, view_graph());
  map.shows_background = !goes_through(map.map) && shows_background(*view, map.map);
  assess_independent_motion(&map);
  return map;
}

std::vector<FinishedMap> Tracker::Impl::maps() {
  if (!worker_.latest()) return {};
  const std::uint32_t present = worker_.latest()->map_id;
  std::vector<FinishedMap> maps = {finished()};
  for (const std::uint32_t id : worker_.mapper().inactive_maps()) {
    show(id);
    if (!options_.localize_only && !frames_[id].empty()) worker_.mapper().finish();
    follow_mapper();  // its scale may have changed
    adjust_frames(*worker_.latest());
    maps.push_back(finished());
  }
  show(present);
  std::stable_sort(maps.begin() + 1, maps.end(), [](const FinishedMap& a, const FinishedMap& b) {
    return a.trajectory.size() > b.trajectory.size();
  });
  return maps;
}

void Tracker::Impl::assess_maps(std::int64_t images, std::vector<FinishedMap>* maps) {
  for (FinishedMap& map : *maps) {
    MapEvidence evidence;
    evidence.map = &map.map;
    evidence.graph = &view_graph();
    evidence.path = &map.precision;
    evidence.is_first = &map == &maps->front();
    if (!evidence.is_first) evidence.name = "map_" + std::to_string(&map - &maps->front() + 1);
    evidence.is_loaded = map.is_loaded() || options_.localize_only;
    evidence.rests_on_two_views = rests_on_two_views_;
    evidence.is_object = is_narrow(map.map);
    evidence.registered = map.trajectory.size();
    evidence.images = images;
    evidence.reversal_p_value = reversal_p_value(options_.bundle, map.map);
    evidence.planar_p_value = planar_p_value(options_.bundle, options_.ransac(camera_.focal()), map.map);
    map.quality = assess(evidence, {});
  }
}

FrameReport Tracker::Impl::register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                                const PreparedImage& image, const cv::Mat& mask) {
  FrameReport report;
  const std::optional<Frame> frame = make_frame_again(frame_index, stamp_ns, image, mask, &report);
  const TrackingMapPtr map = worker_.latest();
  RegistrationReport registration;
  if (frame && map) {
    registration = register_again(*frame, *map);
    if (registration.success) set_pose(*frame, *map, registration, Among::kAll, true);
    describe(registration, &report);
  }
  const auto is_this = [&](const auto& entry) { return entry.second.frame_index == frame_index; };
  if (map && !registration.success && std::none_of(map->keyframes.begin(), map->keyframes.end(), is_this)) {
    frames_[map->map_id].erase(frame_index);
  }
  finish_report(&report);
  return report;
}

// Whether no object is wanted and the map is of a place that the camera moves through: static features are
// then ego-vehicle features.
bool Tracker::Impl::goes_through(const Map& map) const {
  return !options_.segmentation.wants_turning_object() && !stays_in_view(map);
}

// Where the supposed object in front of a static background is the view itself, the mapper separates
// ego-vehicle features and overlaid text from it. An object so near that it extends beyond the image hides
// its background.
void Tracker::Impl::choose_masks(const Frame& frame, const TrackingMap& map, const Rigid3& camera_from_map) {
  if (!options_.segmentation.is_automatic() || options_.segmentation.wants_turning_object()) return;
  if (!object_finder_.knows_motion() || motion_map_ != map.map_id) return;
  object_finder_.mask_by_motion(frame.index, !has_left_behind(map, camera_, camera_from_map));
}

bool Tracker::Impl::may_have_background() {
  const bool has_map = worker_.latest() && !worker_.mapper().map().keyframes().empty();
  return looks_for_background() && !(has_map && goes_through(worker_.mapper().map()));
}

// Tested for a map that stays in view. Keyframes with masks have no background features, but masks that were
// found in some of the images say nothing about the others.
bool Tracker::Impl::shows_background(const TrackingMap& view, const Map& map) {
  if (!looks_for_background() || has_earlier_frames(view)) return false;
  const MotionSegmentationOptions options = motion_options();
  StaticSegmentation background(options, &view_graph());
  for (const SeenImage& image : images_in_time(map)) background.add(image);
  return background.find(options.plainly_static, options_.segmentation.wants_turning_object()).exists;
}

ImageFeaturesPtr Tracker::Impl::features_of(const PreparedImage& image) {
  FrameReport report;
  if (!frame_maker_.has_camera_size(image.image, &report)) return nullptr;
  const std::optional<Frame> frame =
      frame_maker_.make(0, 0, image, Segmentation(), cv::Mat(), false, &report);
  return frame ? frame->image : nullptr;
}

StaticBackground Tracker::Impl::background_of(const std::vector<SeenImage>& images) const {
  const MotionSegmentationOptions options = motion_options();
  StaticSegmentation background(options);
  for (const SeenImage& image : images) background.add(image);
  return background.find(options.faintly_static, options_.segmentation.wants_turning_object());
}

}  // namespace mono_pose_tracker
