#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "mono_pose_tracker/features/feature_set.h"

namespace mono_pose_tracker {

/// Lowe, "Distinctive image features from scale-invariant keypoints" (2004).
struct SiftOptions {
  // own: ours. opencv: cv::SIFT, the reference: slower, always from octave -1, on OpenCV's own number of
  // threads.
  std::string implementation = "own";
  int first_octave = 0;     // -1: the image is doubled first (finer, four times the work); 0; 1: halved
  int max_features = 1500;  // the strongest are kept, spread over the image; 0: all
  // Of the grey range [0, 1], divided by the layers per octave as in cv::SIFT, whose 0.04 leaves fewer.
  float contrast_threshold = 0.03f;
  float edge_threshold = 10.0f;  // ratio of principal curvatures
  int octave_layers = 3;
  // px of the first octave: blur of its base. Lowe doubles the image and takes 1.6, which is 0.8 px of
  // it; 1.2 without doubling finds nearly as fine features in a third of the time. Below, JPEG blocks show.
  float sigma = 1.2f;
  bool root_sift = true;   // Arandjelovic and Zisserman (2012): Hellinger distance
  int min_features = 800;  // own: the contrast threshold is lowered (to a quarter at most) below this many
  int num_threads = 1;     // own: the result is the same for any number

  /// Throws std::invalid_argument naming key, value and range.
  void validate() const;
};

/// Steps of a mask's value per px of scale.
constexpr int kMaskScaleSteps = 8;

/// Finds features and their descriptors. Keeps its buffers between calls: one extractor, one thread.
class FeatureExtractor {
 public:
  virtual ~FeatureExtractor() = default;
  /// gray: CV_8UC1. mask: empty, or CV_8UC1 of the same size: 0 = no feature here, 255 = any, values between:
  /// features of this scale (times kMaskScaleSteps) at most. Deterministic: features
  /// come ordered by falling response. Bearings are left empty. An image too small for one octave gives no
  /// feature.
  virtual void extract(const cv::Mat& gray, const cv::Mat& mask, FeatureSet* features) = 0;
};

/// The extractor that options.implementation names.
std::unique_ptr<FeatureExtractor> make_sift_extractor(const SiftOptions& options);

}  // namespace mono_pose_tracker
