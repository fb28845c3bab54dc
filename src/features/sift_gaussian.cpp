#include "sift_gaussian.h"

#include <algorithm>
#include <cmath>

#include "common/function_clones.h"
#include "sift_sums.h"

namespace mono_pose_tracker {
namespace {

constexpr float kReachInSigmas =
    4.0f;  // what a Gaussian holds beyond (6e-5) is below the noise of 8-bit images

// Rows of the output filtered together, and the floats of them taken at a time: these rows and those that the
// kernel reaches stay in a first-level cache of 32 KB while each is used many times.
constexpr int kBandRows = 16;
constexpr int kTile = 2 * kPlaneBlock;

MPT_FUNCTION_CLONES
void interleave(const float* even, const float* odd, int pairs, float* __restrict out) {
  for (int i = 0; i < pairs; ++i) {
    out[2 * i] = even[i];
    out[2 * i + 1] = odd[i];
  }
}

int mirrored(int i, int size) {
  while (i < 0 || i >= size) i = i < 0 ? -i : 2 * (size - 1) - i;
  return i;
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

void BandFilter::filter(const Plane& in, const PairKernel& kernel, int row_step, int begin, int end,
                        Plane* out) {
  for (int first = begin; first < end; first += kBandRows) {
    const int count = std::min(kBandRows, end - first);
    centres_.clear();
    for (int i = 0; i < count; ++i) centres_.push_back({(first + i) * row_step, &kernel});
    filter_vertically(in, centres_.data(), count, kernel.reach());
    for (int i = 0; i < count; ++i) filter_along_row(i, kernel, in.padded_width(), out->row(first + i));
  }
}

void BandFilter::filter_doubled(const Plane& in, const PairKernel& on_samples,
                                const PairKernel& between_samples, int begin, int end, Plane* out) {
  even_.resize(in.padded_width());
  odd_.resize(in.padded_width());
  for (int first = begin; first < end; first += kBandRows) {
    const int count = std::min(kBandRows, end - first);
    centres_.clear();
    for (int y = first; y < first + count; ++y) {
      centres_.push_back({y / 2, y % 2 ? &between_samples : &on_samples});
    }
    filter_vertically(in, centres_.data(), count, std::max(on_samples.reach(), between_samples.reach()));
    for (int i = 0; i < count; ++i) {
      filter_along_row(i, on_samples, in.padded_width(), even_.data());
      filter_along_row(i, between_samples, in.padded_width(), odd_.data());
      float* to = out->row(first + i);
      interleave(even_.data(), odd_.data(), out->width() / 2, to);
      if (out->width() % 2) to[out->width() - 1] = even_[out->width() / 2];
    }
  }
}

void BandFilter::filter_vertically(const Plane& in, const Centre* centres, int count, int margin) {
  margin_ = std::max(margin, kSumsMargin);
  band_stride_ = in.padded_width() + 2 * margin_ + kPlaneBlock;
  const std::size_t band_size = static_cast<std::size_t>(band_stride_) * kBandRows;
  if (band_.size() < band_size) band_.resize(band_size);
  int reach = 0;
  for (int i = 0; i < count; ++i) reach = std::max(reach, centres[i].vertical->reach());
  const int first = centres[0].row - reach;
  rows_.resize(centres[count - 1].row + reach - first + 1);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    rows_[i] = in.row(mirrored(first + static_cast<int>(i), in.height()));
  }
  for (int x = 0; x < in.padded_width(); x += kTile) {
    sum_vertically(centres, count, first, x, std::min(x + kTile, in.padded_width()));
  }
  for (int i = 0; i < count; ++i) {
    float* row = band_row(i);
    for (int k = 0; k < margin; ++k) {
      row[-1 - k] = row[mirrored(-1 - k, in.width())];
      row[in.width() + k] = row[mirrored(in.width() + k, in.width())];
    }
  }
}

// Columns [begin, end) of the band; rows_ begins with row `first`.
void BandFilter::sum_vertically(const Centre* centres, int count, int first, int begin, int end) {
  for (int i = 0; i < count; ++i) {
    const PairKernel& kernel = *centres[i].vertical;
    const float* const* rows = rows_.data() + centres[i].row - first;
    const bool with_next = i + 1 < count && centres[i + 1].row == centres[i].row + 1 &&
                           centres[i + 1].vertical == &kernel && !kernel.between_samples;
    if (with_next) {
      sums_.two_rows(rows, kernel.weights.data(), kernel.reach(), begin, end, band_row(i), band_row(i + 1));
      ++i;
    } else {
      sums_.rows(rows, kernel.shift(), kernel.weights.data(), kernel.reach(), begin, end, band_row(i));
    }
  }
}

void BandFilter::filter_along_row(int i, const PairKernel& kernel, int width, float* out) {
  sums_.samples(band_row(i), kernel.shift(), kernel.weights.data(), kernel.reach(), width, out);
}

}  // namespace mono_pose_tracker
