#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/files.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

struct FeatureMemoryOptions {
  std::size_t memory_bytes = std::size_t{64} << 20;   // more is stored in a temporary file
  std::uint64_t file_bytes = std::uint64_t{8} << 30;  // of that file; no more features are stored then
  std::string folder;                                 // of that file; empty: that of the system
};

// Cache of the features of a recording's images, for a further run with the same masks or for an image that
// is registered again. For one camera. Any thread.
class FeatureMemory {
 public:
  explicit FeatureMemory(FeatureMemoryOptions options = {}) : options_(std::move(options)) {}

  // Features with these options and clearance; null: not in the cache.
  ImageFeaturesPtr find(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance) const;
  // Stores the last two different results of each image (with and without a mask, for example), while there
  // is room.
  void keep(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance,
            const ImageFeaturesPtr& features);

 private:
  struct Known {
    SiftOptions sift;
    cv::Size clearance_size;
    std::size_t clearance_hash = 0;
    ImageFeaturesPtr features;  // null: they are in the file
    std::uint64_t begin = 0;    // of their bytes in the file
    std::size_t bytes = 0;      // of memory, or in the file
  };

  bool store(const ImageFeatures& features, Known* known);
  ImageFeaturesPtr read(const Known& known) const;

  const FeatureMemoryOptions options_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::vector<Known>> of_image_;
  std::size_t bytes_ = 0;  // in memory
  std::unique_ptr<TemporaryFile> file_;
  CameraModel camera_;  // of the features in the file
};

// Features of a recording's images, by index. A long recording is thinned to every second or fourth image
// over its whole length. A few hundred megabytes at most. One thread.
class SeenImages {
 public:
  static constexpr std::size_t kMost = 400;

  void add(std::int64_t index, ImageFeaturesPtr image) {
    if (index % step_ != 0) return;
    images_[index] = std::move(image);
    if (images_.size() <= kMost) return;
    step_ *= 2;
    for (auto at = images_.begin(); at != images_.end();) {
      at = at->first % step_ == 0 ? std::next(at) : images_.erase(at);
    }
  }

  ImageFeaturesPtr find(std::int64_t index) const {  // null: not stored
    const auto found = images_.find(index);
    return found == images_.end() ? nullptr : found->second;
  }

 private:
  std::map<std::int64_t, ImageFeaturesPtr> images_;
  std::int64_t step_ = 1;  // between stored indices
};

}  // namespace mono_pose_tracker
