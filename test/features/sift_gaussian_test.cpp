#include "features/sift_gaussian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mono_pose_tracker {
namespace {

Plane random_plane(int width, int height) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  Plane plane;
  plane.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.row(y)[x] = uniform(generator);
  }
  return plane;
}

int mirrored_at(int i, int size) {
  while (i < 0 || i >= size) i = i < 0 ? -i : 2 * (size - 1) - i;
  return i;
}

// The kernel as the pairs that it is made of, at (x, y), or half a sample behind where it lies between two.
double filtered_at(const Plane& in, const PairKernel& along_y, const PairKernel& along_x, int x, int y) {
  const auto row_at = [&](int r) {
    const float* row = in.row(mirrored_at(r, in.height()));
    double sum = 0;
    for (int i = 0; i < along_x.reach(); ++i) {
      sum += static_cast<double>(along_x.weights[i]) *
             (row[mirrored_at(x - i, in.width())] + row[mirrored_at(x + i + along_x.shift(), in.width())]);
    }
    return sum;
  };
  double sum = 0;
  for (int i = 0; i < along_y.reach(); ++i) {
    sum += along_y.weights[i] * (row_at(y - i) + row_at(y + i + along_y.shift()));
  }
  return sum;
}

struct Case {
  int width, height;
  float sigma;
};

// Narrower and lower than the kernel reaches; wider than a block; whole blocks; kernels of more pairs than a
// vector has floats.
class BandFilterTest : public testing::TestWithParam<Case> {
 protected:
  const Plane in_ = random_plane(GetParam().width, GetParam().height);
  const PairKernel kernel_ = gaussian_kernel(GetParam().sigma);
  BandFilter filter_;
  Plane out_;
};

TEST_P(BandFilterTest, WeighsWithAMirroredBorder) {
  for (const int row_step : {1, 2}) {
    out_.resize(in_.width(), (in_.height() + row_step - 1) / row_step);
    filter_.filter(in_, kernel_, row_step, 0, out_.height(), &out_);
    for (int y = 0; y < out_.height(); ++y) {
      for (int x = 0; x < out_.width(); ++x) {
        ASSERT_NEAR(out_.row(y)[x], filtered_at(in_, kernel_, kernel_, x, y * row_step), 1e-5)
            << x << " " << y;
      }
    }
  }
}

TEST_P(BandFilterTest, RowsAreTheSameWhereverOneBegins) {
  out_.resize(in_.width(), in_.height());
  filter_.filter(in_, kernel_, 1, 0, in_.height(), &out_);
  Plane parts = in_;
  filter_.filter(in_, kernel_, 1, 0, 3, &parts);
  filter_.filter(in_, kernel_, 1, 3, in_.height(), &parts);
  for (int y = 0; y < in_.height(); ++y) {
    for (int x = 0; x < in_.width(); ++x) ASSERT_EQ(parts.row(y)[x], out_.row(y)[x]) << x << " " << y;
  }
}

TEST_P(BandFilterTest, DoublesAtWholeAndHalfSamples) {
  const PairKernel between = gaussian_kernel(GetParam().sigma, true);
  out_.resize(2 * in_.width() - 1, 2 * in_.height() - 1);
  filter_.filter_doubled(in_, kernel_, between, 0, out_.height(), &out_);
  for (int y = 0; y < out_.height(); ++y) {
    for (int x = 0; x < out_.width(); ++x) {
      const double expected =
          filtered_at(in_, y % 2 ? between : kernel_, x % 2 ? between : kernel_, x / 2, y / 2);
      ASSERT_NEAR(out_.row(y)[x], expected, 1e-5) << x << " " << y;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, BandFilterTest,
                         testing::Values(Case{13, 12, 1.6f}, Case{12, 41, 3.2f}, Case{70, 20, 0.8f},
                                         Case{128, 17, 1.2f}, Case{65, 33, 4.5f}));

}  // namespace
}  // namespace mono_pose_tracker
