#include "feature_memory.h"

#include <cstring>
#include <stdexcept>
#include <tuple>

#include "common/pixel_hash.h"
#include "io/byte_stream.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kKeptOfImage = 2;

// Whether two options give the same features, for any number of threads. Each member is named here, so that a
// new one does not compile until it is considered.
bool finds_the_same(const SiftOptions& a, const SiftOptions& b) {
  const auto what_counts = [](const SiftOptions& options) {
    const auto& [implementation, first_octave, reduction, max_features, contrast_threshold, edge_threshold,
                 octave_layers, sigma, finer_for_small_objects, root_sift, min_features, min_contrast_share,
                 num_threads, cancelled] = options;
    (void)num_threads;
    (void)cancelled;
    return std::tie(implementation, first_octave, reduction, max_features, contrast_threshold, edge_threshold,
                    octave_layers, sigma, finer_for_small_objects, root_sift, min_features,
                    min_contrast_share);
  };
  return what_counts(a) == what_counts(b);
}

std::size_t bytes_in_memory(const ImageFeatures& features) {
  constexpr std::size_t kOfFeature = 128 + sizeof(Feature) + sizeof(Eigen::Vector3d) +
                                     sizeof(Eigen::Matrix<double, 2, 3>) + sizeof(float) + sizeof(cv::Vec3b);
  return kOfFeature * static_cast<std::size_t>(features.size());
}

std::string to_bytes(const ImageFeatures& image) {
  ByteWriter out;
  for (int i = 0; i < image.size(); ++i) {
    const Feature& feature = image.set.features[i];
    for (const float value :
         {feature.pixel.x(), feature.pixel.y(), feature.scale, feature.angle, feature.response}) {
      out.f32(value);
    }
    out.raw(image.color_rgb[i].val, 3);
    out.raw(image.set.descriptor(i), static_cast<std::size_t>(image.set.descriptors.cols));
  }
  return out.bytes();
}

ImageFeaturesPtr from_bytes(const std::string& bytes, const CameraModel& camera) {
  constexpr std::size_t kDescriptorBytes = 128, kOfFeature = 5 * sizeof(float) + 3 + kDescriptorBytes;
  ByteReader in(bytes);
  FeatureSet set;
  set.features.resize(bytes.size() / kOfFeature);
  if (!bytes.empty()) set.descriptors.create(set.size(), kDescriptorBytes, CV_8U);
  std::vector<cv::Vec3b> color_rgb(set.features.size());
  for (int i = 0; i < set.size(); ++i) {
    Feature& feature = set.features[i];
    for (float* value :
         {&feature.pixel.x(), &feature.pixel.y(), &feature.scale, &feature.angle, &feature.response}) {
      *value = in.f32();
    }
    std::memcpy(color_rgb[i].val, in.raw(3).data(), 3);
    std::memcpy(set.descriptors.ptr(i), in.raw(kDescriptorBytes).data(), kDescriptorBytes);
  }
  return restore_image_features(std::move(set), std::move(color_rgb), camera);
}

}  // namespace

ImageFeaturesPtr FeatureMemory::find(std::int64_t index, const SiftOptions& sift,
                                     const cv::Mat& clearance) const {
  const std::size_t hash = pixel_hash(clearance);
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto of_image = of_image_.find(index);
  if (of_image == of_image_.end()) return nullptr;
  for (const Known& known : of_image->second) {
    if (known.clearance_hash != hash || known.clearance_size != clearance.size()) continue;
    if (finds_the_same(known.sift, sift)) return known.features ? known.features : read(known);
  }
  return nullptr;
}

void FeatureMemory::keep(std::int64_t index, const SiftOptions& sift, const cv::Mat& clearance,
                         const ImageFeaturesPtr& features) {
  if (is_set(sift.cancelled)) return;  // the features may be incomplete
  Known known{sift, clearance.size(), pixel_hash(clearance), features, 0, bytes_in_memory(*features)};
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Known>& of_image = of_image_[index];
  if (of_image.size() == kKeptOfImage) {
    if (of_image.front().features) bytes_ -= of_image.front().bytes;
    of_image.erase(of_image.begin());
  }
  if (bytes_ + known.bytes <= options_.memory_bytes) {
    bytes_ += known.bytes;
  } else if (!store(*features, &known)) {
    return;
  }
  of_image.push_back(std::move(known));
}

bool FeatureMemory::store(const ImageFeatures& features, Known* known) {
  if (!file_) file_ = std::make_unique<TemporaryFile>(options_.folder, options_.file_bytes);
  const std::string bytes = to_bytes(features);
  known->features.reset();
  known->begin = file_->size();
  known->bytes = bytes.size();
  camera_ = features.camera;
  return file_->append(bytes);
}

ImageFeaturesPtr FeatureMemory::read(const Known& known) const {
  std::string bytes(known.bytes, '\0');
  if (!file_->read(known.begin, &bytes)) return nullptr;
  try {
    return from_bytes(bytes, camera_);
  } catch (const std::invalid_argument&) {  // close to the image's edge: to be found again
    return nullptr;
  }
}

}  // namespace mono_pose_tracker
