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

// True where two masks say the same of every pixel.
bool is_same_mask(const cv::Mat& a, const cv::Mat& b);

cv::Mat to_gray(const cv::Mat& image);

// Does ahead what a frame's features need (paper, step 2), on as many threads as call it. Where the object
// is, it can only guess: where a given mask says. While that proves right, all is done ahead, otherwise what
// no mask changes.
class ImagePreparer : public std::enable_shared_from_this<ImagePreparer> {
 public:
  ImagePreparer(const SiftOptions& sift, const SegmentationOptions& segmentation, const CameraModel& camera);

  // mask: what will be given with the image. An image of another size than the camera's is left as it is.
  // memory: may know what is found in it, or gets to know it; may be null.
  PreparedImage prepare(const cv::Mat& image, const cv::Mat& mask, FeatureMemory* memory,
                        std::int64_t index) const;

  // Whether the last guess was right.
  void learn(bool was_right) const { guesses_ = was_right; }

 private:
  // Extractors that nobody uses; it outlives the preparer as long as one is out.
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
