#include "object_finder.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "common/statistics.h"
#include "segmentation/object_outline.h"
#include "tracking/background_image.h"

namespace mono_pose_tracker {

constexpr ObjectFinderOptions kFinder{};

std::vector<cv::Point2f> pixels_of(const Frame& frame, const RegistrationReport& registration) {
  std::vector<cv::Point2f> pixels;
  for (const FrameObservation& o : registration.observations) {
    const Eigen::Vector2f& pixel = frame.image->set.features[o.feature].pixel;
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  return pixels;
}

ObjectFinder::ObjectFinder(const SegmentationOptions& options, const CameraModel& camera)
    : options_(options),
      camera_(camera),
      segmenter_(options, read_background_image(options)),
      motion_mask_(options) {}

// Whether an object may be found by its motion: no mask is given.
bool ObjectFinder::looks_for_motion(const cv::Mat& given) const {
  return options_.is_by_motion() || (options_.is_automatic() && given.empty());
}

Segmentation ObjectFinder::find(const cv::Mat& image, const cv::Mat& given, bool may_begin, bool masks) {
  Segmentation segmentation = segmenter_.segment(image, given);
  if (!looks_for_motion(given)) return segmentation;
  // While a map without two motions is tracked, none are searched.
  if (!may_begin && !motion_mask_.is_started()) return segmentation;
  motion_mask_.watch(image);
  if (motion_mask_.is_started() && masks && masks_now()) {
    segmentation.mask = given.empty() ? motion_mask_.mask() : motion_mask_.mask() & segmentation.mask;
    segmentation.method = Segmentation::kByMotion;
  }
  return segmentation;
}

bool ObjectFinder::masks_at(std::int64_t frame_index) const {
  const auto next = masks_after_.lower_bound(frame_index);
  return next == masks_after_.begin() || std::prev(next)->second;
}

void ObjectFinder::mask_by_motion(std::int64_t frame_index, bool on) {
  if (on != masks_now()) masks_after_[frame_index] = on;
}

Segmentation ObjectFinder::find_again(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& given,
                                      bool masks) {
  Segmentation segmentation = segmenter_.segment_again(image, given);
  if (!masks || !looks_for_motion(given) || !motion_mask_.is_started() || !masks_at(frame_index))
    return segmentation;
  const cv::Mat mask = motion_mask_.mask_of(image);
  if (mask.empty()) return segmentation;  // of another size or another number of colours
  segmentation.mask = given.empty() ? mask : mask & segmentation.mask;
  segmentation.method = Segmentation::kByMotion;
  return segmentation;
}

void ObjectFinder::start(const BootstrapReport& bootstrap, const Frame& frame,
                         const RegistrationReport& registration) {
  masks_after_.clear();
  motion_mask_.start(pixels_of(frame, registration), bootstrap.static_background,
                     static_cast<int>(frame.index - bootstrap.reference_index), bootstrap.moved_px);
  visited_ = {registration.camera_from_map};
}

// Median distance between the landmarks' present pixels and those at another pose; px. Very large where none
// of them was in view.
double ObjectFinder::moved_since(const Rigid3& camera_from_map, const Frame& frame, const TrackingMap& map,
                                 const RegistrationReport& registration) const {
  std::vector<double> moved;
  for (const FrameObservation& o : registration.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    Eigen::Vector2d before;
    if (landmark == map.landmarks.end() || !camera_.project(camera_from_map * landmark->second, &before))
      continue;
    moved.push_back((frame.image->set.features[o.feature].pixel.cast<double>() - before).norm());
  }
  return moved.empty() ? std::numeric_limits<double>::max() : median(std::move(moved));
}

// Updates the mask with the object's pixels and its displacement. A motion that returns the object to an
// earlier place, such as a nodding head, does not count: its texture is there again.
void ObjectFinder::follow(const Frame& frame, const TrackingMap& map,
                          const RegistrationReport& registration) {
  if (!motion_mask_.is_started() || !masks_now()) return;
  double moved = std::numeric_limits<double>::max();
  for (const Rigid3& visited : visited_) {
    moved = std::min(moved, moved_since(visited, frame, map, registration));
  }
  const bool is_known = moved < std::numeric_limits<double>::max();  // otherwise this is the first place
  const bool is_new = is_known && moved >= kFinder.least_move_px;
  if (is_new || !is_known) visited_.push_back(registration.camera_from_map);
  if (visited_.size() > kFinder.most_visited) visited_.erase(visited_.begin());
  motion_mask_.observe(pixels_of(frame, registration), is_new ? moved : 0);
}

// Where features are allowed; empty: everywhere.
cv::Mat ObjectFinder::clearance(const cv::Mat& mask, const SegmentationOptions& options,
                                const CameraModel& camera) {
  if (mask.empty()) return mask;
  // Mask errors grow with the image: masks are made at a fixed size, or drawn by hand.
  const double size = image_scale(camera);
  return clearance_of(mask, size * options.margin_px, options.margin_scales, kMaskScaleSteps);
}

}  // namespace mono_pose_tracker
