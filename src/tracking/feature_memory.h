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

// The features of a recording's images, for whoever looks at an image again in the same way: a further
// attempt by the same masks, an image that is posed once more. Of one camera. Any thread.
class FeatureMemory {
 public:
  // By these options, where the clearance lets features be. Null: not known.
  ImageFeaturesPtr find(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance) const;
  // Of each image the last two that differ, as of the whole and of what moves in it, while there is room.
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
