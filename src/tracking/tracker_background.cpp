// The end of a recording: what stood still while something moved.

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Where masks told an object from what is behind it, the keyframes have none of that.
StillBackground Tracker::Impl::background_in(const TrackingMap& view, const Map& map,
                                             const MatchesInTime& in_time) const {
  if (!looks_for_background() || is_segmented_ || has_earlier_frames(view)) return {};
  return find_still_background(map, in_time, options_.matching, options_.segmentation.body == "turning",
                               options_.threads);
}

ImageFeaturesPtr Tracker::Impl::features_of(const PreparedImage& image) {
  FrameReport report;
  if (!frame_maker_.has_camera_size(image.image, &report)) return nullptr;
  const std::optional<Frame> frame =
      frame_maker_.make(0, 0, image, Segmentation(), cv::Mat(), false, &report);
  return frame ? frame->image : nullptr;
}

StillBackground Tracker::Impl::background_of(const std::vector<SeenImage>& images) const {
  return find_still_background(images, options_.matching, options_.segmentation.body == "turning",
                               options_.threads);
}

}  // namespace mono_pose_tracker
