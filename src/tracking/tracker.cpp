#include "mono_pose_tracker/tracking/tracker.h"

#include <utility>

#include "tracker_impl.h"
#include "tracking/map_snapshot.h"

namespace mono_pose_tracker {

Tracker::Tracker(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
                 std::function<void()> before_mapping) {
  options.validate();
  impl_ = std::make_unique<Impl>(options, camera, mapping, std::move(before_mapping));
}

Tracker::~Tracker() = default;

FrameReport Tracker::process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask) {
  return impl_->process(stamp_ns, image, mask);
}

void Tracker::pass_over() { impl_->pass_over(); }

void Tracker::cancel() { impl_->cancel(); }

PreparedImage Tracker::prepare(const cv::Mat& image, const cv::Mat& mask, FeatureMemory* memory,
                               std::int64_t index) const {
  return impl_->frame_maker().prepare(image, mask, memory, index);
}

void Tracker::wait() { impl_->wait(); }

void Tracker::reset() { impl_->reset(); }

void Tracker::restart() { impl_->restart(); }

void Tracker::set_options(const TrackerOptions& options) {
  options.validate();
  impl_->set_options(options);
}

void Tracker::transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  if (impl_->worker().latest()) impl_->worker().transform(new_from_map, scale_source);
}

void Tracker::set_load_level(int level) { impl_->set_load_level(level); }

std::uint32_t Tracker::epoch() const { return impl_->epoch(); }

std::optional<SavedMaps> Tracker::copy_maps() { return impl_->copy_maps(); }

void Tracker::load_maps(SavedMaps saved) { impl_->load_maps(std::move(saved)); }

std::uint64_t Tracker::revision() const {
  const TrackingMapPtr map = impl_->worker().latest();
  return map ? map->revision : 0;
}

TrackingMapPtr Tracker::view() const { return impl_->worker().latest(); }

std::shared_ptr<const MapSnapshot> Tracker::snapshot() const { return snapshot_of(view()); }

std::vector<RegisteredFrame> Tracker::trajectory() const { return impl_->trajectory(); }

bool Tracker::finish() { return impl_->finish(); }

FrameReport Tracker::keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns,
                                    const PreparedImage& image, const cv::Mat& mask) {
  return impl_->keep_for_later(frame_index, stamp_ns, image, mask);
}

const ViewGraph& Tracker::view_graph() { return impl_->view_graph(); }

void Tracker::fill_gaps() { impl_->fill_gaps(); }

void Tracker::expect_object() { impl_->expect_object(); }

bool Tracker::may_have_background() { return impl_->may_have_background(); }

ImageFeaturesPtr Tracker::features_of(const PreparedImage& image) { return impl_->features_of(image); }

StaticBackground Tracker::background_of(const std::vector<SeenImage>& images) const {
  return impl_->background_of(images);
}

std::set<std::int64_t> Tracker::adjust_frames() {
  const TrackingMapPtr map = view();
  return map ? impl_->adjust_frames(*map) : std::set<std::int64_t>();
}

std::set<std::int64_t> Tracker::refine_with_graph() { return impl_->refine_with_graph(); }

std::vector<FinishedMap> Tracker::maps() { return impl_->maps(); }

void Tracker::assess_maps(std::int64_t images, std::vector<FinishedMap>* maps) {
  impl_->assess_maps(images, maps);
}

FrameReport Tracker::register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                          const PreparedImage& image, const cv::Mat& mask) {
  return impl_->register_image_again(frame_index, stamp_ns, image, mask);
}

const Map& Tracker::map() const { return impl_->worker().mapper().map(); }

const std::vector<ClosedLoop>& Tracker::loops() const { return impl_->worker().mapper().loops(); }

int Tracker::failed_adjustments() const { return impl_->worker().mapper().failed_adjustments(); }

bool Tracker::rests_on_two_views() const { return impl_->rests_on_two_views(); }

}  // namespace mono_pose_tracker
