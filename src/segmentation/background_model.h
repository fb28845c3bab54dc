#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/segmentation/segmentation_options.h"

namespace mono_pose_tracker {

struct BackgroundModelOptions {
  double sigmas = 5;          // see SegmentationOptions
  double min_difference = 8;  // grey levels of 255
  double shadow = 0.5;
  double update_rate = 0.02;
};

/// Model of a static background, a Gaussian per pixel and channel. Images are CV_8UC1 or CV_8UC3, all of one
/// size and type.
class BackgroundModel {
 public:
  explicit BackgroundModel(const BackgroundModelOptions& options = {}) : options_(options) {}

  /// Learnt from images of the background: median and median deviation of each pixel, so that objects present
  /// in fewer than half of them are not learnt.
  void learn(const std::vector<cv::Mat>& images);

  /// Learnt from one image; sigma (grey levels) is assumed for the noise.
  void learn(const cv::Mat& image, double sigma);

  bool empty() const { return mean_.empty(); }
  cv::Size size() const { return mean_.size(); }
  int channels() const { return mean_.channels(); }

  /// 255 where the image differs from the background and not as under a shadow (CV_8UC1). The exposure is
  /// compared where `outside` is not 0 (background expected); empty: everywhere.
  cv::Mat foreground(const cv::Mat& image, const cv::Mat& outside) const;

  /// The image with its exposure adjusted to the model's, compared where `outside` is not 0.
  cv::Mat with_exposure_of_model(const cv::Mat& image, const cv::Mat& outside) const;

  /// Replaces the background by the image where `where` (CV_8UC1) is not 0.
  void set(const cv::Mat& image, const cv::Mat& where);

  /// Adapts the model to the image where `outside` (CV_8UC1) is not 0.
  void update(const cv::Mat& image, const cv::Mat& outside);

 private:
  float exposure_gain(const cv::Mat& image, const cv::Mat& outside) const;
  cv::Mat brightness_ratio(const cv::Mat& image, float gain) const;
  bool is_dimmed(const std::uint8_t* pixel, float gain, const cv::Mat& ratio, int y, int x) const;
  void remove_shadows(const cv::Mat& image, float gain, cv::Mat* foreground) const;

  BackgroundModelOptions options_;
  cv::Mat mean_;   // CV_32F, channels of the image
  cv::Mat sigma_;  // the same
};

// px of the reduced image. Opening removes specks of noise; closing bridges places where the object resembles
// the background.
constexpr int kOpeningRadius = 1;
constexpr int kClosingRadius = 4;
// px of the reduced image by which motion blur may extend the object.
constexpr int kUpdateRadius = 5;

/// The image at the working width, at most 320 px.
cv::Mat reduced(const cv::Mat& image);

/// A mask of a reduced image at full size.
cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size);

/// Pixels farther than radius [px] from the mask.
cv::Mat outside_of(const cv::Mat& mask, int radius);

/// CV_8UC1; the image itself where it is that.
cv::Mat gray_of(const cv::Mat& image);

BackgroundModelOptions model_options(const SegmentationOptions& options);

}  // namespace mono_pose_tracker
