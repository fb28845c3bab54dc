#include "sift_gaussian.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "function_clones.h"
#include "sift_vector.h"

namespace mono_pose_tracker {
namespace {

constexpr float kReachInSigmas =
    4.0f;  // what a Gaussian holds beyond (6e-5) is below the noise of 8-bit images

// out[x] = sum over i of weights[i] * (before[i][x] + after[i][x]), width a multiple of kPlaneBlock.
MPT_FUNCTION_CLONES
void sum_of_pairs(const float* const* before, const float* const* after, const float* weights, int pairs,
                  int width, float* __restrict out) {
  for (int x = 0; x < width; x += kPlaneBlock) {
    Floats8 sum0 = {}, sum1 = {}, sum2 = {}, sum3 = {};
    for (int i = 0; i < pairs; ++i) {
      const float* a = before[i] + x;
      const float* b = after[i] + x;
      const float w = weights[i];
      sum0 += w * (MPT_SIFT_LOAD(a) + MPT_SIFT_LOAD(b));
      sum1 += w * (MPT_SIFT_LOAD(a + 8) + MPT_SIFT_LOAD(b + 8));
      sum2 += w * (MPT_SIFT_LOAD(a + 16) + MPT_SIFT_LOAD(b + 16));
      sum3 += w * (MPT_SIFT_LOAD(a + 24) + MPT_SIFT_LOAD(b + 24));
    }
    MPT_SIFT_STORE(out + x, sum0);
    MPT_SIFT_STORE(out + x + 8, sum1);
    MPT_SIFT_STORE(out + x + 16, sum2);
    MPT_SIFT_STORE(out + x + 24, sum3);
  }
}

int mirrored(int i, int size) {
  return i >= 0 && i < size ? i : cv::borderInterpolate(i, size, cv::BORDER_REFLECT_101);
}

}  // namespace

PairKernel gaussian_kernel(float sigma, bool between_samples) {
  PairKernel kernel;
  kernel.between_samples = between_samples;
  const double first = between_samples ? 0.5 : 0.0;
  const int pairs = static_cast<int>(std::ceil(kReachInSigmas * sigma - first)) + 1;
  std::vector<double> weights(pairs);
  double sum = 0;
  for (int i = 0; i < pairs; ++i) {
    const double distance = i + first;
    weights[i] = std::exp(-0.5 * distance * distance / (sigma * sigma));
    if (i == 0 && !between_samples) weights[i] *= 0.5;
    sum += 2 * weights[i];
  }
  for (const double weight : weights) kernel.weights.push_back(static_cast<float>(weight / sum));
  return kernel;
}

void RowFilter::filter(const Plane& in, int y, const PairKernel& vertical, const PairKernel& horizontal,
                       float* out) {
  filter_vertically(in, y, vertical, horizontal.reach());
  filter_horizontally(horizontal, in.stride(), out);
}

void RowFilter::filter_doubled(const Plane& in, int y, const PairKernel& vertical,
                               const PairKernel& on_samples, const PairKernel& between_samples, int out_width,
                               float* out) {
  filter_vertically(in, y, vertical, std::max(on_samples.reach(), between_samples.reach()));
  even_.resize(in.stride());
  odd_.resize(in.stride());
  filter_horizontally(on_samples, in.stride(), even_.data());
  filter_horizontally(between_samples, in.stride(), odd_.data());
  for (int x = 0; x < out_width / 2; ++x) {
    out[2 * x] = even_[x];
    out[2 * x + 1] = odd_[x];
  }
  if (out_width % 2) out[out_width - 1] = even_[out_width / 2];
}

void RowFilter::filter_vertically(const Plane& in, int y, const PairKernel& kernel, int margin) {
  const int pairs = static_cast<int>(kernel.weights.size());
  before_.resize(pairs);
  after_.resize(pairs);
  for (int i = 0; i < pairs; ++i) {
    const int below = y + i + (kernel.between_samples ? 1 : 0);
    before_[i] = in.row(mirrored(y - i, in.height()));
    after_[i] = in.row(mirrored(below, in.height()));
  }
  margin_ = margin;
  padded_row_.resize(in.stride() + 2 * margin + kPlaneBlock);
  float* row = padded_row_.data() + margin;
  sum_of_pairs(before_.data(), after_.data(), kernel.weights.data(), pairs, in.stride(), row);
  for (int i = 0; i < margin; ++i) {
    row[-1 - i] = row[mirrored(-1 - i, in.width())];
    row[in.width() + i] = row[mirrored(in.width() + i, in.width())];
  }
}

void RowFilter::filter_horizontally(const PairKernel& kernel, int stride, float* out) {
  const int pairs = static_cast<int>(kernel.weights.size());
  before_.resize(pairs);
  after_.resize(pairs);
  const float* row = padded_row_.data() + margin_;
  for (int i = 0; i < pairs; ++i) {
    before_[i] = row - i;
    after_[i] = row + i + (kernel.between_samples ? 1 : 0);
  }
  sum_of_pairs(before_.data(), after_.data(), kernel.weights.data(), pairs, stride, out);
}

}  // namespace mono_pose_tracker
