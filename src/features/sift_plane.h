#pragma once

#include <cstddef>
#include <vector>

namespace mono_pose_tracker {

constexpr int kPlaneBlock = 32;  // floats that the hot loops take at a time

/// One channel of floats. Rows are padded to whole blocks; what lies beyond the width is finite and means
/// nothing.
class Plane {
 public:
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    stride_ = (width + kPlaneBlock - 1) / kPlaneBlock * kPlaneBlock;
    data_.resize(static_cast<std::size_t>(stride_) * height +
                 kPlaneBlock);  // hot loops read a block past a row
  }
  int width() const { return width_; }
  int height() const { return height_; }
  int stride() const { return stride_; }
  float* row(int y) { return data_.data() + static_cast<std::size_t>(stride_) * y; }
  const float* row(int y) const { return data_.data() + static_cast<std::size_t>(stride_) * y; }

 private:
  int width_ = 0;
  int height_ = 0;
  int stride_ = 0;
  std::vector<float> data_;
};

}  // namespace mono_pose_tracker
