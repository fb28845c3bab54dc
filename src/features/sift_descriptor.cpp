#include "sift_descriptor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/function_clones.h"
#include "sift_angle.h"
#include "sift_vector.h"

namespace mono_pose_tracker {
namespace {

constexpr int kCells = 4;               // along each side
constexpr int kDirections = 8;          // elements of a Floats8
constexpr float kCellInSigmas = 3.0f;   // width of a cell (as in Lowe's program)
constexpr float kWindowInCells = 2.0f;  // sigma of the weights: half the width of the descriptor
constexpr float kLargestEntry = 0.2f;   // of a unit vector: what strong light-dependent gradients may have
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
      const float window = std::exp(-0.5f * in_cells * in_cells / (kWindowInCells * kWindowInCells));
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
                       float histogram[kDescriptorSize]) {
  static const SampleWeights weights;
  const float step = kCellInSigmas * sigma / kSamplesPerCell;
  Patch patch;
  std::fill_n(patch.values + kPatch * kRow, 8, 0.0f);
  sample_patch(gaussian.row(0), gaussian.stride(), gaussian.width(), gaussian.height(), x, y,
               step * std::cos(angle), step * std::sin(angle), patch.values);
  compute_gradients(patch.values, patch.magnitude, patch.direction);
  pool(patch.magnitude, patch.direction, weights, histogram);
  limit_entries(kLargestEntry, histogram);
}

}  // namespace mono_pose_tracker
