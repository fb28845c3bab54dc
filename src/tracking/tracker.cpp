#include "mono_pose_tracker/tracking/tracker.h"

#include <utility>

#include "tracker_impl.h"

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

const Map& Tracker::map() const { return impl_->worker().mapper().map(); }

}  // namespace mono_pose_tracker
