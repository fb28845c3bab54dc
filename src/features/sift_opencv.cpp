#include "sift_opencv.h"

#include <stdexcept>

#include "common/opencv_version.h"
#include "sift_budget.h"
#include "sift_normalisation.h"

#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT

#include <opencv2/features2d.hpp>

namespace mono_pose_tracker {
namespace {

constexpr float kRadiansPerDegree = 0.017453292519943295f;

// cv::SIFT doubles the image with cv::resize, whose pixel x lies at x / 2 - 0.25 of the input, but reports x
// / 2.
constexpr float kUpsamplingShift = 0.25f;  // px

constexpr float kLoweSigma = 1.6f;  // px of the doubled image

Feature feature_of(const cv::KeyPoint& key_point) {
  Feature feature;
  feature.pixel = {key_point.pt.x - kUpsamplingShift, key_point.pt.y - kUpsamplingShift};
  feature.scale = 0.5f * key_point.size;
  feature.angle = key_point.angle * kRadiansPerDegree;
  feature.response = key_point.response;
  return feature;
}

class OpencvSift : public FeatureExtractor {
 public:
  explicit OpencvSift(const SiftOptions& options)
      : options_(options),
        sift_(cv::SIFT::create(0, options.octave_layers, options.contrast_threshold, options.edge_threshold,
                               options.sigma.value_or(kLoweSigma))) {}

  void prepare(const cv::Mat& gray) override {
    check_images(gray, cv::Mat());
    gray_ = gray;
    key_points_.clear();
    if (!gray.empty()) sift_->detectAndCompute(gray, cv::noArray(), key_points_, descriptors_);
  }

  void find(const cv::Mat& mask, FeatureSet* set) override {
    check_images(gray_, mask);
    set->features.clear();
    set->bearings.clear();
    candidates_.clear();
    source_rows_.clear();
    for (std::size_t i = 0; i < key_points_.size(); ++i) {
      const Feature feature = feature_of(key_points_[i]);
      if (!is_masked_out(mask, feature)) {
        candidates_.push_back(feature);
        source_rows_.push_back(static_cast<int>(i));
      }
    }
    const std::vector<int>& chosen = budget_.choose(candidates_, gray_.size(), options_.max_features);
    set->descriptors.create(static_cast<int>(chosen.size()), kDescriptorSize, CV_8U);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      set->features.push_back(candidates_[chosen[i]]);
      quantise_descriptor(descriptors_.ptr<float>(source_rows_[chosen[i]]), options_.root_sift,
                          set->descriptors.ptr<std::uint8_t>(static_cast<int>(i)));
    }
  }

 private:
  SiftOptions options_;
  cv::Ptr<cv::SIFT> sift_;
  FeatureBudget budget_;
  cv::Mat gray_;
  std::vector<cv::KeyPoint> key_points_;
  cv::Mat descriptors_;
  std::vector<Feature> candidates_;
  std::vector<int> source_rows_;
};

}  // namespace

std::unique_ptr<FeatureExtractor> make_opencv_sift(const SiftOptions& options) {
  return std::make_unique<OpencvSift>(options);
}

bool has_opencv_sift() { return true; }

}  // namespace mono_pose_tracker

#else

namespace mono_pose_tracker {

std::unique_ptr<FeatureExtractor> make_opencv_sift(const SiftOptions&) {
  throw std::invalid_argument("this build uses an OpenCV version without SIFT: OpenCV 4.4 or newer has it");
}

bool has_opencv_sift() { return false; }

}  // namespace mono_pose_tracker

#endif
