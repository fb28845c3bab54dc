#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "segmentation/background_model.h"

namespace mono_pose_tracker {

/// Threshold that splits a histogram of 256 levels in two (Otsu 1979): the level belongs to the lower class.
struct OtsuCut {
  int level = 0;
  double separation =
      0;  // variance between the classes over all variance: 0.64 of one Gaussian, 1 of two spikes
};
OtsuCut otsu_cut(const std::array<double, 256>& histogram);

/// Limits for splitting the lower class of a dark backdrop again (an object with dark and bright parts).
struct BackdropOptions {
  double two_classes = 0.8;       // smallest separation (OtsuCut); an even spread has 0.75
  double most_of_border = 0.5;    // smallest share of the image's border that the backdrop covers
  double min_class_share = 0.04;  // of the image: the rim where the object blurs into the backdrop has less
};

enum class Backdrop { kAuto, kDark, kBright };
enum class Chroma { kGreen, kBlue };

/// Raw foreground (CV_8UC1, 255) in front of a dark or bright backdrop. image: CV_8UC1 or BGR. kAuto: decided
/// by the image's border. level: grey level of the split; negative: found.
cv::Mat threshold_foreground(const cv::Mat& image, Backdrop backdrop, double level,
                             const BackdropOptions& limits = {});

/// Raw foreground in front of a green or blue backdrop. image: BGR; in a grey image everything is foreground.
/// level: excess of the backdrop's channel over the others; negative: found.
cv::Mat chroma_foreground(const cv::Mat& image, Chroma chroma, double level);

struct Segmentation {
  std::string method = kNoMask;  // that found the mask
  cv::Mat mask;                  // CV_8UC1 of the image's size, 255 = object; empty: all of it may be
  Reason reason = Reason::kOk;   // or kLearningBackground: there is no mask yet
  std::string text;

  static constexpr const char* kNoMask = "none";
  static constexpr const char* kGivenMask = "mask";
  static constexpr const char* kByMotion = "motion";
  bool is_by_motion() const { return method == kByMotion; }
};

/// Thresholds of the Segmenter in addition to the user's SegmentationOptions.
struct SegmenterLimits {
  MaskRadii radii;
  int learning_images = 15;      // enough for median and spread of a pixel; more would only use memory
  double given_image_sigma = 2;  // grey levels: noise of a webcam at half its size, where the background is
                                 // one given image
};

/// Finds the object in each image with the methods that need no motion: a given mask, a background, a plain
/// backdrop. Works on images reduced to 320 px width; masks have full size. One thread.
class Segmenter {
 public:
  /// background_image: CV_8UC3, the reference of the method `background`; empty: learnt from the first
  /// images.
  explicit Segmenter(const SegmentationOptions& options, const cv::Mat& background_image = {},
                     const SegmenterLimits& limits = {});

  /// Segments the next image of a sequence and updates the background model. given: empty, or a mask (not 0 =
  /// object), which is intersected with that of the method, if any.
  Segmentation segment(const cv::Mat& image, const cv::Mat& given);

  /// Segments an image out of order; nothing is learnt.
  Segmentation segment_again(const cv::Mat& image, const cv::Mat& given);

 private:
  void forget();
  Segmentation find(const cv::Mat& image, const cv::Mat& given, bool learn);
  Segmentation find_unaided(const cv::Mat& image, bool learn);
  Segmentation by_background(const cv::Mat& small, bool learn);
  bool learn_background(const cv::Mat& small, bool learn, Segmentation* result);
  cv::Mat clean(const cv::Mat& raw) const;

  SegmentationOptions options_;
  SegmenterLimits limits_;
  cv::Mat background_image_;
  BackgroundModel background_;
  std::vector<cv::Mat> learning_;  // images to learn from
  int learning_seen_ = 0;
  cv::Mat outside_;  // where the last image showed background, of the model's size
};

}  // namespace mono_pose_tracker
