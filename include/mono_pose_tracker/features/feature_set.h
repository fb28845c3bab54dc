#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <vector>

namespace mono_pose_tracker {

struct Feature {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // sub-pixel, centre of the first pixel at (0, 0)
  float scale = 0;                                  // Gaussian sigma in px of the input image
  float angle = 0;                                  // rad, x towards y (clockwise as seen)
  float response = 0;                               // contrast, larger is better
};

/// Features of one image: features[i] belongs to descriptors.row(i) and bearings[i].
struct FeatureSet {
  std::vector<Feature> features;
  cv::Mat descriptors;                    // N x 128, CV_8U
  std::vector<Eigen::Vector3d> bearings;  // unit, in the camera's frame; filled by the tracker

  int size() const { return static_cast<int>(features.size()); }
  const std::uint8_t* descriptor(int i) const { return descriptors.ptr<std::uint8_t>(i); }
};

/// The descriptors that `descriptor_of` gives of the items, a row each (N x 128, CV_8U).
template <typename Item, typename DescriptorOf>
cv::Mat stacked_descriptors(const std::vector<Item>& items, const DescriptorOf& descriptor_of) {
  constexpr int kBytes = 128;
  cv::Mat descriptors(static_cast<int>(items.size()), kBytes, CV_8U);
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::memcpy(descriptors.ptr(static_cast<int>(i)), descriptor_of(items[i]), kBytes);
  }
  return descriptors;
}

}  // namespace mono_pose_tracker
