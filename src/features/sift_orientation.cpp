#include "sift_orientation.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "common/function_clones.h"
#include "sift_angle.h"
#include "sift_vector.h"

namespace mono_pose_tracker {
namespace {

constexpr int kBins = 36;
constexpr float kWindowInSigmas = 1.5f;  // sigma of the weights, in sigmas of the key point
constexpr float kReachInWindows = 3.0f;
constexpr float kPeakShare = 0.8f;  // of the highest peak: lower ones are no orientation of their own
constexpr int kMaxReach = 64;       // px; octave_layers = 1 has key points up to sigma 4.5 px, a reach of 20

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

Histogram gather_histogram(const Plane& gaussian, float x, float y, float sigma) {
  const float window = kWindowInSigmas * sigma;
  const int reach = std::min(cvRound(kReachInWindows * window), kMaxReach);
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
                      std::array<float, kMaxOrientations>* angles) {
  const Histogram histogram = smooth(gather_histogram(gaussian, x, y, sigma));
  const float lowest_peak = kPeakShare * *std::max_element(histogram.begin(), histogram.end());
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

}  // namespace mono_pose_tracker
