#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "mono_pose_tracker/tracking/tracker.h"

namespace mono_pose_tracker {

class FeatureMemory;

// Whether two masks agree at every pixel.
bool is_same_mask(const cv::Mat& a, const cv::Mat& b);

cv::Mat to_gray(const cv::Mat& image);

// Prepares the features of frames ahead (paper, step 2), on as many threads as call it. The object's mask is
// guessed to be the given one. While that guess is right, everything is prepared ahead, otherwise only what
// is independent of the mask.
class ImagePreparer : public std::enable_shared_from_this<ImagePreparer> {
 public:
  ImagePreparer(const SiftOptions& sift, const SegmentationOptions& segmentation, const CameraModel& camera);

  // mask: the mask that will be given with the image. An image of another size than the camera's is not
  // prepared. memory: cache of features, read and written; may be null.
  PreparedImage prepare(const cv::Mat& image, const cv::Mat& mask, FeatureMemory* memory,
                        std::int64_t index) const;

  // Whether the last guess was right.
  void learn(bool was_right) const { guesses_ = was_right; }

 private:
  // Idle extractors. The pool outlives the preparer while an extractor is borrowed.
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<FeatureExtractor>> idle;
  };

  std::shared_ptr<FeatureExtractor> borrow_extractor() const;
  cv::Mat guess_clearance(const cv::Mat& mask) const;

  const SiftOptions sift_;
  const SegmentationOptions segmentation_;
  const CameraModel camera_;
  const std::shared_ptr<Pool> pool_ = std::make_shared<Pool>();
  mutable std::atomic<bool> guesses_{true};
};

}  // namespace mono_pose_tracker
