#include "frame_maker.h"

#include <utility>

#include "camera/camera_parameters.h"
#include "features/marker.h"

namespace mono_pose_tracker {

void show_features(const Frame& frame, FrameReport* report) {
  report->features = frame.image->size();
  report->seen.clear();
  for (const Feature& feature : frame.image->set.features) report->seen.push_back({feature.pixel, {}, -1});
}

FrameMaker::FrameMaker(const SiftOptions& sift, const ScaleOptions& scale,
                       const SegmentationOptions& segmentation, const CameraModel& camera)
    : scale_(scale), camera_(camera) {
  set_options(sift, segmentation);
}

void FrameMaker::set_options(const SiftOptions& sift, const SegmentationOptions& segmentation) {
  extractor_ = make_sift_extractor(sift);
  preparer_ = std::make_shared<ImagePreparer>(sift, segmentation, camera_);
}

bool FrameMaker::has_camera_size(const cv::Mat& image, FrameReport* report) const {
  if (image.cols == camera_.width() && image.rows == camera_.height()) return true;
  report->reason = Reason::kImageSizeMismatch;
  report->reason_text =
      "the image " + size_mismatch_text(image.cols, image.rows, camera_.width(), camera_.height(), "");
  return false;
}

ImageFeaturesPtr FrameMaker::features_of(const PreparedImage& prepared, const cv::Mat& gray,
                                         const cv::Mat& clearance, StageTimes* stages) {
  const bool is_prepared = prepared.by && prepared.by == preparer_;  // with the current options
  const bool is_guess_right = is_prepared && is_same_mask(prepared.clearance, clearance);
  if (is_prepared) {
    preparer_->learn(is_guess_right);
    stages->insert(stages->end(), prepared.stages.begin(), prepared.stages.end());
  }
  if (is_guess_right && prepared.features) return prepared.features;
  FeatureSet features;
  {
    const StageTimer timer(*stages, "features");
    if (is_prepared && prepared.extractor) {
      prepared.extractor->find(clearance, &features);
    } else {
      extractor_->extract(gray.empty() ? to_gray(prepared.image) : gray, clearance, &features);
    }
  }
  const StageTimer timer(*stages, "undistort");
  return make_image_features(std::move(features), prepared.image, camera_);
}

std::optional<Frame> FrameMaker::make(std::int64_t index, std::int64_t stamp_ns,
                                      const PreparedImage& prepared, const Segmentation& segmentation,
                                      const cv::Mat& clearance, bool looks_for_marker, FrameReport* report) {
  report->mask = segmentation.mask;
  report->segmentation = segmentation.method;
  if (segmentation.reason != Reason::kOk) {
    report->reason = segmentation.reason;
    report->reason_text = segmentation.text;
    return std::nullopt;
  }
  const bool needs_marker = looks_for_marker && scale_.marker_size > 0;
  const cv::Mat gray = prepared.features && !needs_marker ? cv::Mat() : to_gray(prepared.image);
  Frame frame;
  frame.index = index;
  frame.stamp_ns = stamp_ns;
  frame.image = features_of(prepared, gray, clearance, &report->stages);
  // Only the views that begin a map set its scale.
  if (needs_marker) {
    const StageTimer timer(report->stages, "marker");
    for (const Eigen::Vector2d& corner : find_marker(gray, scale_.marker_dictionary, scale_.marker_id)) {
      frame.marker.push_back(camera_.bearing(corner));
    }
  }
  frame.is_masked = !segmentation.mask.empty();
  show_features(frame, report);
  return frame;
}

}  // namespace mono_pose_tracker
