// The end of a recording: what stood still while something moved.

#include "tracker_impl.h"

namespace mono_pose_tracker {

// Where masks told an object from what is behind it, the keyframes have none of that.
bool Tracker::Impl::shows_background(const TrackingMap& view, const Map& map,
                                     const MatchesInTime& in_time) const {
  if (!looks_for_background() || is_segmented_ || has_earlier_frames(view)) return false;
  const StillBackground background =
      find_still_background(images_in_time(map), in_time, options_.matching,
                            options_.segmentation.wants_turning_body(), options_.threads);
  return background.exists;
}

ImageFeaturesPtr Tracker::Impl::features_of(const PreparedImage& image) {
  FrameReport report;
  if (!frame_maker_.has_camera_size(image.image, &report)) return nullptr;
  const std::optional<Frame> frame =
      frame_maker_.make(0, 0, image, Segmentation(), cv::Mat(), false, &report);
  return frame ? frame->image : nullptr;
}

StillBackground Tracker::Impl::background_of(const std::vector<SeenImage>& images) const {
  const MatchesInTime in_time = match_in_time(images, options_.matching, options_.threads);
  return find_still_background(images, in_time, options_.matching, options_.segmentation.wants_turning_body(),
                               options_.threads);
}

}  // namespace mono_pose_tracker
