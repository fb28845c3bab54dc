#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <utility>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

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
