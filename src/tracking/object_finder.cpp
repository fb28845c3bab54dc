#include "object_finder.h"

#include <algorithm>

#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/segmentation/mask_cleaning.h"

namespace mono_pose_tracker {

namespace {

std::vector<cv::Point2f> object_pixels(const Frame& frame, const ResectionReport& resection) {
  std::vector<cv::Point2f> pixels;
  for (const FrameObservation& o : resection.observations) {
    const Eigen::Vector2f& pixel = frame.image->set.features[o.feature].pixel;
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  return pixels;
}

}  // namespace

ObjectFinder::ObjectFinder(const SegmentationOptions& options, const CameraModel& camera)
    : options_(options), camera_(camera), segmenter_(options), motion_mask_(options) {}

// Given no mask, an object may be found by its motion.
bool ObjectFinder::looks_for_motion(const cv::Mat& given) const {
  const std::string& method = options_.method;
  return method == "motion" || (method == "auto" && given.empty());
}

Segmentation ObjectFinder::find(const cv::Mat& image, const cv::Mat& given, bool bootstrapping) {
  Segmentation segmentation = segmenter_.segment(image, given);
  if (!looks_for_motion(given)) return segmentation;
  // Once there is a map without two motions, none will be looked for.
  if (!bootstrapping && !motion_mask_.is_started()) return segmentation;
  motion_mask_.watch(image);
  if (motion_mask_.is_started()) {
    segmentation.mask = given.empty() ? motion_mask_.mask() : motion_mask_.mask() & segmentation.mask;
    segmentation.method = "motion";
  }
  return segmentation;
}

Segmentation ObjectFinder::find_again(const cv::Mat& image, const cv::Mat& given) {
  Segmentation segmentation = segmenter_.segment_again(image, given);
  if (!looks_for_motion(given) || !motion_mask_.is_started()) return segmentation;
  const cv::Mat mask = motion_mask_.mask_of(image);
  segmentation.mask = given.empty() ? mask : mask & segmentation.mask;
  segmentation.method = "motion";
  return segmentation;
}

void ObjectFinder::start(const BootstrapReport& bootstrap, const Frame& frame,
                         const ResectionReport& resection) {
  motion_mask_.start(object_pixels(frame, resection), bootstrap.still_background,
                     static_cast<int>(frame.index - bootstrap.reference_index), bootstrap.moved_px);
  motion_pose_ = resection.camera_from_map;
}

// Tells the mask where the object was found, and how far it has gone. Noise of the poses is no movement: it
// counts from two pixels on.
void ObjectFinder::follow(const Frame& frame, const TrackingMap& map, const ResectionReport& resection) {
  constexpr double kLeastMove = 2;  // px
  if (!motion_mask_.is_started()) return;
  std::vector<double> moved;
  for (const FrameObservation& o : resection.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    Eigen::Vector2d before;
    if (landmark == map.landmarks.end() || !camera_.project(motion_pose_ * landmark->second, &before))
      continue;
    moved.push_back((frame.image->set.features[o.feature].pixel.cast<double>() - before).norm());
  }
  const double median_moved = median(std::move(moved));
  if (median_moved >= kLeastMove) motion_pose_ = resection.camera_from_map;
  motion_mask_.observe(object_pixels(frame, resection), median_moved >= kLeastMove ? median_moved : 0);
}

// Where features may be; empty: anywhere.
cv::Mat ObjectFinder::clearance(const cv::Mat& mask, const SegmentationOptions& options,
                                const CameraModel& camera) {
  if (mask.empty()) return mask;
  // What a mask is off by grows with the image: masks are made at a fixed size, or drawn by hand.
  const double size = std::max(1.0, camera.width() / 640.0);
  return clearance_of(mask, size * options.margin_px, options.margin_scales, kMaskScaleSteps);
}

}  // namespace mono_pose_tracker
