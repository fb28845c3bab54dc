#pragma once

#include <cstddef>
#include <vector>

#include "huge_pages.h"

namespace mono_pose_tracker {

constexpr int kPlaneBlock = 64;  // floats that the hot loops take at a time

/// One channel of floats. Rows are padded to whole blocks and are an odd number of blocks apart; otherwise
/// the rows of an image with a width of a power of two would share few sets of the cache. Padding is finite
/// and meaningless.
class Plane {
 public:
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    const int blocks = (width + kPlaneBlock - 1) / kPlaneBlock;
    padded_width_ = blocks * kPlaneBlock;
    stride_ = (blocks | 1) * kPlaneBlock;
    data_.resize(static_cast<std::size_t>(stride_) * height +
                 kPlaneBlock);  // hot loops read a block past a row
  }
  int width() const { return width_; }
  int height() const { return height_; }
  int padded_width() const { return padded_width_; }  // whole blocks
  int stride() const { return stride_; }
  float* row(int y) { return data_.data() + static_cast<std::size_t>(stride_) * y; }
  const float* row(int y) const { return data_.data() + static_cast<std::size_t>(stride_) * y; }

 private:
  int width_ = 0;
  int height_ = 0;
  int padded_width_ = 0;
  int stride_ = 0;
  std::vector<float, HugePageAllocator<float>> data_;
};

}  // namespace mono_pose_tracker
