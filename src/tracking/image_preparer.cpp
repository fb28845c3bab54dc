#include "image_preparer.h"

#include <opencv2/imgproc.hpp>
#include <utility>

#include "feature_memory.h"
#include "object_finder.h"

namespace mono_pose_tracker {

bool is_same_mask(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || b.empty()) return a.empty() && b.empty();
  return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0;
}

cv::Mat to_gray(const cv::Mat& image) {
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

ImagePreparer::ImagePreparer(const SiftOptions& sift, const SegmentationOptions& segmentation,
                             const CameraModel& camera)
    : sift_(sift), segmentation_(segmentation), camera_(camera) {}

PreparedImage ImagePreparer::prepare(const cv::Mat& image, const cv::Mat& mask, FeatureMemory* memory,
                                     std::int64_t index) const {
  PreparedImage prepared;
  prepared.image = image;
  if (image.cols != camera_.width() || image.rows != camera_.height()) return prepared;
  prepared.by = shared_from_this();
  prepared.clearance = guess_clearance(mask);
  if (memory && guesses_) prepared.features = memory->find(index, sift_, prepared.clearance);
  if (prepared.features) return prepared;
  const std::shared_ptr<FeatureExtractor> extractor = borrow_extractor();
  if (!guesses_) {
    const StageTimer timer(prepared.stages, "features_ahead");
    extractor->prepare(to_gray(image));
    prepared.extractor = extractor;
    return prepared;
  }
  FeatureSet features;
  {
    const StageTimer timer(prepared.stages, "features");
    extractor->extract(to_gray(image), prepared.clearance, &features);
  }
  const StageTimer timer(prepared.stages, "undistort");
  prepared.features = make_image_features(std::move(features), image, camera_);
  if (memory) memory->keep(index, sift_, prepared.clearance, prepared.features);
  return prepared;
}

cv::Mat ImagePreparer::guess_clearance(const cv::Mat& mask) const {
  if (segmentation_.is_off() || mask.empty()) return {};
  return ObjectFinder::clearance(mask != 0, segmentation_, camera_);
}

std::shared_ptr<FeatureExtractor> ImagePreparer::borrow_extractor() const {
  std::unique_ptr<FeatureExtractor> extractor;
  {
    const std::lock_guard<std::mutex> lock(pool_->mutex);
    if (!pool_->idle.empty()) {
      extractor = std::move(pool_->idle.back());
      pool_->idle.pop_back();
    }
  }
  if (!extractor) extractor = make_sift_extractor(sift_);
  const auto give_back = [pool = pool_](FeatureExtractor* used) {
    std::unique_ptr<FeatureExtractor> idle(used);
    const std::lock_guard<std::mutex> lock(pool->mutex);
    pool->idle.push_back(std::move(idle));
  };
  return {extractor.release(), give_back};
}

}  // namespace mono_pose_tracker
