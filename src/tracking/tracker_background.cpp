// The end of a recording: static background behind a moving object.

#include "mapping/in_view.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

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

// Tested for a map that stays in view. Where masks separated an object, the keyframes have no background
// features.
bool Tracker::Impl::shows_background(const TrackingMap& view, const Map& map) {
  if (!looks_for_background() || is_segmented_ || has_earlier_frames(view)) return false;
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
