#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Cache of the features of a recording's images, for a further run with the same masks or for an image that
// is registered again. For one camera. Any thread.
class FeatureMemory {
 public:
  // Features with these options and clearance; null: not in the cache.
  ImageFeaturesPtr find(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance) const;
  // Stores the last two different results of each image (with and without a mask, for example), while there
  // is room.
  void keep(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance,
            const ImageFeaturesPtr& features);

 private:
  struct Known {
    SiftOptions sift;
    cv::Mat clearance;
    ImageFeaturesPtr features;
  };

  mutable std::mutex mutex_;
  std::map<std::int64_t, std::vector<Known>> of_image_;
  std::size_t bytes_ = 0;
};

}  // namespace mono_pose_tracker
