#include "frame_maker.h"

#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mono_pose_tracker/features/marker.h"

namespace mono_pose_tracker {

FrameMaker::FrameMaker(const SiftOptions& sift, const ScaleOptions& scale, const CameraModel& camera)
    : scale_(scale), camera_(camera), extractor_(make_sift_extractor(sift)) {}

void FrameMaker::set_options(const SiftOptions& sift) { extractor_ = make_sift_extractor(sift); }

bool FrameMaker::has_camera_size(const cv::Mat& image, FrameReport* report) const {
  if (image.cols == camera_.width() && image.rows == camera_.height()) return true;
  char text[128];
  std::snprintf(text, sizeof text, "image is %dx%d, the camera %dx%d", image.cols, image.rows,
                camera_.width(), camera_.height());
  report->reason = Reason::kImageSizeMismatch;
  report->reason_text = text;
  return false;
}

std::optional<Frame> FrameMaker::make(std::int64_t index, std::int64_t stamp_ns, const cv::Mat& image,
                                      const Segmentation& segmentation, const cv::Mat& clearance,
                                      bool looks_for_marker, FrameReport* report) {
  report->mask = segmentation.mask;
  report->segmentation = segmentation.method;
  if (segmentation.reason != Reason::kOk) {
    report->reason = segmentation.reason;
    report->reason_text = segmentation.text;
    return std::nullopt;
  }
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  Frame frame;
  frame.index = index;
  frame.stamp_ns = stamp_ns;
  FeatureSet features;
  {
    const StageTimer timer(report->stages, "features");
    extractor_->extract(gray, clearance, &features);
  }
  // Only the views that begin a map set its scale.
  if (looks_for_marker && scale_.marker_size > 0) {
    const StageTimer timer(report->stages, "marker");
    for (const Eigen::Vector2d& corner : find_marker(gray, scale_.marker_dictionary, scale_.marker_id)) {
      frame.marker.push_back(camera_.bearing(corner));
    }
  }
  const StageTimer timer(report->stages, "undistort");
  frame.image = make_image_features(std::move(features), image, camera_);
  frame.is_masked = !segmentation.mask.empty();
  report->features = frame.image->size();
  for (const Feature& feature : frame.image->set.features) report->seen.push_back({feature.pixel, {}, -1});
  return frame;
}

}  // namespace mono_pose_tracker
