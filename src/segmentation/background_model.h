#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/segmentation/segmentation_options.h"

namespace mono_pose_tracker {

/// Grey levels are in [0, 255]; lengths are in px of the images given, which are reduced to 320 px width.
struct BackgroundModelOptions {
  double sigmas = 5;          // see SegmentationOptions
  double min_difference = 8;  // grey levels
  double shadow = 0.5;
  double update_rate = 0.02;

  // Noise of a pixel, grey levels.
  float min_sigma = 1;   // sensors have 8 bits, and a few images may show no noise at all
  float max_sigma = 12;  // larger deviations are objects that passed during learning

  // Exposure, the median ratio of brightnesses.
  int exposure_step = 4;                 // px between the compared pixels: a sixteenth of them is as accurate
  float too_dark = 10;                   // grey levels: below, the ratio is noise
  float clipped = 250;                   // grey levels: above, the sensor may be saturated
  std::size_t min_exposure_ratios = 50;  // with fewer the median may be that of an object

  // Shadows.
  int shadow_window = 5;          // px: texture and noise average out
  int shadow_shift = 3;           // px to the windows next to a pixel: half a window and a soft edge
  float min_shadow_share = 0.8F;  // of the window's pixels: by chance, single pixels of an object look dimmed
};

/// Radii for masks, in px of the reduced image.
struct MaskRadii {
  int opening = 1;      // removes specks of noise
  int closing = 4;      // bridges places where the object resembles the background
  int motion_blur = 5;  // by which the object may extend beyond its mask; the background is not learnt there
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

/// The image at the working width [px], at most 320: an object's outline is found to a pixel at this width,
/// and the work stays at 2 ms.
cv::Mat reduced(const cv::Mat& image, int working_width = 320);

/// A mask of a reduced image at full size.
cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size);

/// Pixels farther than radius [px] from the mask.
cv::Mat outside_of(const cv::Mat& mask, int radius);

/// CV_8UC1; the image itself where it is that.
cv::Mat gray_of(const cv::Mat& image);

BackgroundModelOptions model_options(const SegmentationOptions& options);

}  // namespace mono_pose_tracker
