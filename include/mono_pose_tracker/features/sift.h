#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "mono_pose_tracker/common/cancel_flag.h"
#include "mono_pose_tracker/features/feature_set.h"

namespace mono_pose_tracker {

/// Time limit of the search: a live frame must be done before the next one arrives, a recording waits.
enum class SearchPace { kLive, kRecording };

/// px: an object of 200 px has some 300 features from octave 0, too few for a map.
constexpr double kSmallObject = 256;

/// Resolution of the first octave.
constexpr int kFinestOctave = -1, kCoarsestOctave = 2;

/// Lowe, "Distinctive image features from scale-invariant keypoints" (2004).
struct SiftOptions {
  static constexpr int kMostFeatures = 1000000;  // that may be asked for

  // own: ours. opencv: cv::SIFT, the reference: slower, always from octave -1, on OpenCV's own number of
  // threads.
  std::string implementation = "own";
  // -1: the image is doubled first (finer, four times the work); 0; 1: halved; 2: halved twice. None: by the
  // image's size (choose_sift_scale).
  std::optional<int> first_octave;
  int reduction = 1;        // own: of the image before that, where first_octave is given (choose_sift_scale)
  int max_features = 1500;  // the strongest are kept, spread over the image; 0: all
  // Of the grey range [0, 1], divided by the layers per octave as in cv::SIFT, whose 0.04 leaves fewer.
  float contrast_threshold = 0.03f;
  float edge_threshold = 10.0f;  // ratio of principal curvatures
  int octave_layers = 3;
  // Blur of the base of the first octave [px]. None: chosen by that octave (choose_sift_scale). Lowe doubles
  // the image and uses 1.6, which is 0.8 px of it; 1.2 without doubling finds nearly as fine features in a
  // third of the time.
  std::optional<float> sigma;
  // own: a small object (its mask's area below kSmallObject squared) is searched one octave finer.
  bool finer_for_small_objects = false;
  bool root_sift = true;   // Arandjelovic and Zisserman (2012): Hellinger distance
  int min_features = 800;  // own: the contrast threshold is lowered below this many
  // own: smallest share of the contrast threshold to which it is lowered, in [0, 1]. Further down, noise of
  // 8-bit images makes key points.
  float min_contrast_share = 0.25f;
  // own: the result is the same for any number. 0: one thread, or live a number by the image's size
  // (choose_sift_threads).
  int num_threads = 0;
  CancelFlag cancelled = nullptr;  // own: once it is set, features are no more than what there is so far

  /// Throws std::invalid_argument naming key, value and range.
  void validate() const;
};

/// Steps of a mask's value per px of scale.
constexpr int kMaskScaleSteps = 8;

/// Finds features and their descriptors. Keeps its buffers between calls: one extractor, one thread at a
/// time.
class FeatureExtractor {
 public:
  virtual ~FeatureExtractor() = default;

  /// In two steps, where the mask is known later than the image. The first does what no mask changes. gray:
  /// CV_8UC1, kept until the next call.
  virtual void prepare(const cv::Mat& gray) = 0;
  /// The features of the image that was prepared last; as often as wanted. mask: empty, or CV_8UC1 of the
  /// same size: 0 = no feature here, 255 = any, values between: features of this scale (times
  /// kMaskScaleSteps) at most. Deterministic: features come ordered by falling response. Bearings are left
  /// empty. An image too small for one octave gives no feature.
  virtual void find(const cv::Mat& mask, FeatureSet* features) = 0;

  /// Both steps.
  void extract(const cv::Mat& gray, const cv::Mat& mask, FeatureSet* features) {
    prepare(gray);
    find(mask, features);
  }
};

/// The extractor that options.implementation names.
std::unique_ptr<FeatureExtractor> make_sift_extractor(const SiftOptions& options);

}  // namespace mono_pose_tracker
