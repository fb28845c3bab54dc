#include "feature_memory.h"

#include <algorithm>
#include <tuple>

#include "image_preparer.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr std::size_t kKeptOfImage = 2;

// Whether two options give the same features, for any number of threads. Each member is named here, so that a
// new one does not compile until it is considered.
bool finds_the_same(const SiftOptions& a, const SiftOptions& b) {
  const auto what_counts = [](const SiftOptions& options) {
    const auto& [implementation, first_octave, reduction, max_features, contrast_threshold, edge_threshold,
                 octave_layers, sigma, finer_for_small_objects, root_sift, min_features, num_threads,
                 cancelled] = options;
    (void)num_threads;
    (void)cancelled;
    return std::tie(implementation, first_octave, reduction, max_features, contrast_threshold, edge_threshold,
                    octave_layers, sigma, finer_for_small_objects, root_sift, min_features);
  };
  return what_counts(a) == what_counts(b);
}

std::size_t bytes_of(const cv::Mat& clearance, const ImageFeatures& features) {
  constexpr std::size_t kOfFeature = 128 + sizeof(Feature) + sizeof(Eigen::Vector3d) +
                                     sizeof(Eigen::Matrix<double, 2, 3>) + sizeof(float) + sizeof(cv::Vec3b);
  return clearance.total() * clearance.elemSize() + kOfFeature * static_cast<std::size_t>(features.size());
}

}  // namespace

ImageFeaturesPtr FeatureMemory::find(std::int64_t index, const SiftOptions& sift,
                                     const cv::Mat& clearance) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto of_image = of_image_.find(index);
  if (of_image == of_image_.end()) return nullptr;
  for (const Known& known : of_image->second) {
    if (finds_the_same(known.sift, sift) && is_same_mask(known.clearance, clearance)) return known.features;
  }
  return nullptr;
}

void FeatureMemory::keep(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance,
                         const ImageFeaturesPtr& features) {
  if (is_set(sift.cancelled)) return;  // the features may be incomplete
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Known>& of_image = of_image_[index];
  if (of_image.size() == kKeptOfImage) {
    bytes_ -= bytes_of(of_image.front().clearance, *of_image.front().features);
    of_image.erase(of_image.begin());
  }
  const std::size_t bytes = bytes_of(clearance, *features);
  if (bytes_ + bytes > kMostBytes) return;
  bytes_ += bytes;
  of_image.push_back({sift, clearance, features});
}

}  // namespace mono_pose_tracker
