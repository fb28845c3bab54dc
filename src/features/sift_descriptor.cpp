#include "sift_descriptor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "common/toolchain.h"
#include "sift_plane.h"

namespace mono_pose_tracker {
namespace {

constexpr float kTwoPi = 6.2831853f;

/// Direction of (x, y) in rad, in [0, 2 pi]; error below 1e-4. No branches: a loop of it becomes vector code.
/// The polynomial is the minimax fit of atan on [0, 1].
inline float direction(float y, float x) {
  const float ax = std::fabs(x);
  const float ay = std::fabs(y);
  const float high = ax > ay ? ax : ay;
  const float low = ax > ay ? ay : ax;
  const float t = low / (high + 1e-30f);
  const float t2 = t * t;
  float angle = t * (0.99997726f +
                     t2 * (-0.33262347f +
                           t2 * (0.19354346f + t2 * (-0.11643287f + t2 * (0.05265332f - t2 * 0.01172120f)))));
  angle = ay > ax ? 0.25f * kTwoPi - angle : angle;
  angle = x < 0 ? 0.5f * kTwoPi - angle : angle;
  return y < 0 ? kTwoPi - angle : angle;
}

constexpr int kBins = 36;
constexpr int kMaxReach = 64;  // px; octave_layers = 1 has key points up to sigma 4.5 px, a reach of 20

using Histogram = std::array<float, kBins>;

// Samples of the window in one row, padded to whole vectors.
constexpr int kMaxRow = (2 * kMaxReach + 1 + 7) / 8 * 8;

struct WeighedRow {
  float lower_share[kMaxRow];  // of weight times magnitude, to its bin
  float upper_share[kMaxRow];  // and to the one after
  int bin[kMaxRow];
};

// count is a multiple of 8, past the end of the row if need be: what lies there is finite.
MPT_FUNCTION_CLONES
void weigh_gradients(const float* above, const float* row, const float* below, int count, float dx0, float dy,
                     float exponent, WeighedRow* __restrict out) {
  for (int i = 0; i < count; ++i) {
    const float gx = row[i + 1] - row[i - 1];
    const float gy = below[i] - above[i];
    const float dx = dx0 + static_cast<float>(i);
    // exp(-t) as (1 - t / 16)^16: a window as good, and plain arithmetic.
    float window = 1.0f + (dx * dx + dy * dy) * exponent * (1.0f / 16.0f);
    window = window > 0 ? window : 0.0f;
    window *= window;
    window *= window;
    window *= window;
    window *= window;
    const float magnitude = window * std::sqrt(gx * gx + gy * gy);
    const float bin = direction(gy, gx) * (kBins / kTwoPi);
    const int whole = static_cast<int>(bin);
    const float upper = (bin - static_cast<float>(whole)) * magnitude;
    out->bin[i] = whole;
    out->upper_share[i] = upper;
    out->lower_share[i] = magnitude - upper;
  }
}

Histogram gather_histogram(const Plane& gaussian, float x, float y, float sigma,
                           const OrientationOptions& options) {
  const float window = options.window_in_sigmas * sigma;
  const int reach = std::min(cvRound(options.reach_in_windows * window), kMaxReach);
  const float exponent = -0.5f / (window * window);
  const int first_y = std::max(cvRound(y) - reach, 1);
  const int last_y = std::min(cvRound(y) + reach, gaussian.height() - 2);
  WeighedRow row;
  std::array<float, kBins + 2> histogram[2] = {};  // in turns, lest one addition wait for another
  for (int v = first_y; v <= last_y; ++v) {
    const int dy = v - cvRound(y);
    const int half = cvRound(std::sqrt(static_cast<float>(reach * reach - dy * dy)));  // of a disc
    const int first_x = std::max(cvRound(x) - half, 1);
    const int last_x = std::min(cvRound(x) + half, gaussian.width() - 2);
    const int count = last_x - first_x + 1;
    weigh_gradients(gaussian.row(v - 1) + first_x, gaussian.row(v) + first_x, gaussian.row(v + 1) + first_x,
                    (count + 7) & ~7, first_x - x, v - y, exponent, &row);
    for (int i = 0; i < count; ++i) {
      float* bin = histogram[i & 1].data() + row.bin[i];
      bin[0] += row.lower_share[i];
      bin[1] += row.upper_share[i];
    }
  }
  for (int i = 0; i < kBins + 2; ++i) histogram[0][i] += histogram[1][i];
  Histogram ring;
  std::copy_n(histogram[0].begin(), kBins, ring.begin());
  ring[0] += histogram[0][kBins];
  ring[1] += histogram[0][kBins + 1];
  return ring;
}

Histogram smooth(const Histogram& in) {
  Histogram out;
  const auto at = [&](int i) { return in[(i + kBins) % kBins]; };
  for (int i = 0; i < kBins; ++i) {
    out[i] = (at(i - 2) + at(i + 2) + 4 * (at(i - 1) + at(i + 1)) + 6 * at(i)) * (1.0f / 16.0f);
  }
  return out;
}

}  // namespace

int find_orientations(const Plane& gaussian, float x, float y, float sigma,
                      std::array<float, kMaxOrientations>* angles, const OrientationOptions& options) {
  const Histogram histogram = smooth(gather_histogram(gaussian, x, y, sigma, options));
  const float lowest_peak = options.peak_share * *std::max_element(histogram.begin(), histogram.end());
  int count = 0;
  for (int i = 0; i < kBins && count < kMaxOrientations; ++i) {
    const float left = histogram[(i + kBins - 1) % kBins];
    const float right = histogram[(i + 1) % kBins];
    const float peak = histogram[i];
    if (peak <= left || peak <= right || peak < lowest_peak) continue;
    const float bin = i + 0.5f * (left - right) / (left - 2 * peak + right);
    const float angle = bin * (kTwoPi / kBins);
    (*angles)[count++] = angle < 0 ? angle + kTwoPi : (angle >= kTwoPi ? angle - kTwoPi : angle);
  }
  return count;
}

namespace {

MPT_FUNCTION_CLONES
void to_bytes(const float* histogram, float scale, bool root, std::uint8_t* __restrict bytes) {
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float value = histogram[i] * scale;
    // Entries of a unit 128-vector are rarely above 0.5.
    const float entry = 512.0f * (root ? std::sqrt(value) : value) + 0.5f;
    bytes[i] = static_cast<std::uint8_t>(static_cast<int>(entry < 255.0f ? entry : 255.0f));
  }
}

MPT_FUNCTION_CLONES
float sum_of(const float* histogram) {
  Floats8 sum = {};
  for (int i = 0; i < kDescriptorSize; i += 8) sum += MPT_SIFT_LOAD(histogram + i);
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

MPT_FUNCTION_CLONES
float sum_of_squares(const float* histogram) {
  Floats8 sum = {};
  for (int i = 0; i < kDescriptorSize; i += 8) {
    const Floats8 entries = MPT_SIFT_LOAD(histogram + i);
    sum += entries * entries;
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

MPT_FUNCTION_CLONES
void scale_and_limit(float scale, float limit, float* histogram) {
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float entry = histogram[i] * scale;
    histogram[i] = entry < limit ? entry : limit;
  }
}

float inverse_length(const float* histogram) {
  const float squared = sum_of_squares(histogram);
  return squared > 0 ? 1.0f / std::sqrt(squared) : 0.0f;
}

}  // namespace

void limit_entries(float largest_entry, float* histogram) {
  scale_and_limit(inverse_length(histogram), largest_entry, histogram);
  scale_and_limit(inverse_length(histogram), 1.0f, histogram);
}

void quantise_descriptor(const float* histogram, bool root_sift, std::uint8_t* descriptor) {
  const float sum = sum_of(histogram);
  if (sum <= 0) {
    std::fill_n(descriptor, kDescriptorSize, std::uint8_t{0});
    return;
  }
  const float scale = root_sift ? 1.0f / sum : 1.0f / std::sqrt(sum_of_squares(histogram));
  to_bytes(histogram, scale, root_sift, descriptor);
}

namespace {

constexpr int kCells = 4;       // along each side
constexpr int kDirections = 8;  // elements of a Floats8
// Samples a cell along each side: 0.75 sigma apart, so that nothing the Gaussian leaves is lost.
constexpr int kSamplesPerCell = 4;
constexpr int kSamples =
    (kCells + 1) * kSamplesPerCell;   // half a cell more on each side: interpolation reaches there
constexpr int kPatch = kSamples + 2;  // a sample more on each side, for the gradients
constexpr int kRow =
    (kPatch + 7) / 8 * 8;  // floats of a row: whole vectors; what is beyond the patch means nothing

struct Patch {
  float values[kPatch * kRow + 8];  // gradients at the end of the last row look beyond it
  float magnitude[kSamples * kRow];
  float direction[kSamples * kRow];  // in [0, 8]
};

// The image on a grid turned by the angle, interpolated bilinearly, the border repeated.
MPT_FUNCTION_CLONES
void sample_patch(const float* image, int stride, int width, int height, float x, float y, float along_x,
                  float along_y, float* __restrict values) {
  constexpr float kHalf = 0.5f * (kPatch - 1);
  const float last_x = static_cast<float>(width) - 1.001f;
  const float last_y = static_cast<float>(height) - 1.001f;
  for (int j = 0; j < kPatch; ++j) {
    const float row_x = x - (static_cast<float>(j) - kHalf) * along_y;
    const float row_y = y + (static_cast<float>(j) - kHalf) * along_x;
    for (int i = 0; i < kRow; ++i) {
      float px = row_x + (static_cast<float>(i) - kHalf) * along_x;
      float py = row_y + (static_cast<float>(i) - kHalf) * along_y;
      px = px > 0 ? px : 0.0f;
      py = py > 0 ? py : 0.0f;
      px = px < last_x ? px : last_x;
      py = py < last_y ? py : last_y;
      const int ix = static_cast<int>(px);
      const int iy = static_cast<int>(py);
      const float fx = px - static_cast<float>(ix);
      const float fy = py - static_cast<float>(iy);
      const int at = iy * stride + ix;
      const float upper = image[at] + fx * (image[at + 1] - image[at]);
      const float lower = image[at + stride] + fx * (image[at + stride + 1] - image[at + stride]);
      values[j * kRow + i] = upper + fy * (lower - upper);
    }
  }
}

MPT_FUNCTION_CLONES
void compute_gradients(const float* values, float* __restrict magnitude,
                       float* __restrict direction_in_bins) {
  for (int i = 0; i < kSamples * kRow; ++i) {
    const float* middle = values + kRow + 1;
    const float gx = middle[i + 1] - middle[i - 1];
    const float gy = middle[i + kRow] - middle[i - kRow];
    magnitude[i] = std::sqrt(gx * gx + gy * gy);
    direction_in_bins[i] = direction(gy, gx) * (kDirections / kTwoPi);
  }
}

// Weights of the samples of half a cell before and after a cell's border, by how far in they are, times the
// window.
struct SampleWeights {
  float before[kSamples];
  float after[kSamples];

  SampleWeights() {
    for (int i = 0; i < kSamples; ++i) {
      const float in_cells = (static_cast<float>(i) - 0.5f * (kSamples - 1)) / kSamplesPerCell;
      const float sigma = 0.5f * kCells;  // half the width of the descriptor
      const float window = std::exp(-0.5f * in_cells * in_cells / (sigma * sigma));
      const float share = (static_cast<float>(i % kSamplesPerCell) + 0.5f) / kSamplesPerCell;
      before[i] = (1 - share) * window;
      after[i] = share * window;
    }
  }
};

// Trilinear: a sample counts in the two nearest cells along each side and the two nearest directions.
MPT_FUNCTION_CLONES
void pool(const float* magnitude, const float* direction_in_bins, const SampleWeights& weights,
          float* __restrict histogram) {
  const Floats8 directions = {0, 1, 2, 3, 4, 5, 6, 7};
  const Floats8 zero = {};
  Floats8 cells[kCells + 2][kCells + 2] = {};  // a ring of cells more, dropped in the end
  for (int j = 0; j < kSamples; ++j) {
    Floats8 row[kCells + 2] = {};
    for (int segment = 0; segment <= kCells; ++segment) {
      for (int k = 0; k < kSamplesPerCell; ++k) {
        const int i = segment * kSamplesPerCell + k;
        Floats8 distance = direction_in_bins[j * kRow + i] - directions;
        distance = distance < zero ? -distance : distance;
        const Floats8 around = 8.0f - distance;
        distance = distance < around ? distance : around;
        Floats8 share = 1.0f - distance;
        share = share > zero ? share : zero;
        share *= magnitude[j * kRow + i];
        row[segment] += weights.before[i] * share;
        row[segment + 1] += weights.after[i] * share;
      }
    }
    const int segment = j / kSamplesPerCell;
    for (int c = 1; c <= kCells; ++c) {
      cells[segment][c] += weights.before[j] * row[c];
      cells[segment + 1][c] += weights.after[j] * row[c];
    }
  }
  for (int r = 0; r < kCells; ++r) {
    for (int c = 0; c < kCells; ++c)
      MPT_SIFT_STORE(histogram + (kCells * r + c) * kDirections, cells[r + 1][c + 1]);
  }
}

}  // namespace

void compute_histogram(const Plane& gaussian, float x, float y, float sigma, float angle,
                       float histogram[kDescriptorSize], const HistogramOptions& options) {
  static const SampleWeights weights;
  const float step = options.cell_in_sigmas * sigma / kSamplesPerCell;
  Patch patch;
  std::fill_n(patch.values + kPatch * kRow, 8, 0.0f);
  sample_patch(gaussian.row(0), gaussian.stride(), gaussian.width(), gaussian.height(), x, y,
               step * std::cos(angle), step * std::sin(angle), patch.values);
  compute_gradients(patch.values, patch.magnitude, patch.direction);
  pool(patch.magnitude, patch.direction, weights, histogram);
  limit_entries(options.largest_entry, histogram);
}

}  // namespace mono_pose_tracker
