#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "features/sift_gaussian.h"
#include "features/sift_plane.h"

namespace mono_pose_tracker {
namespace {

using Instructions = SiftSums::Instructions;

constexpr int kWidth = 3 * kPlaneBlock;
constexpr int kMostPairs = 20;  // more than kSumsMargin
constexpr int kMargin = kMostPairs + 1;
constexpr int kRows = 2 * kMostPairs + 2;
constexpr float kRounding =
    2e-6f;  // of sums of up to 2 * kMostPairs samples below 1, weighed by up to 1 / 20

/// Each kind of instructions that this processor has, with a number of pairs.
class SiftSumsTest : public testing::TestWithParam<std::tuple<Instructions, int>> {
 protected:
  SiftSumsTest() : sums_(SiftSums::of(std::get<0>(GetParam()))), pairs_(std::get<1>(GetParam())) {
    std::mt19937 generator(7);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (std::vector<float>& row : samples_) {
      row.resize(kWidth + 2 * kMargin + kPlaneBlock);
      for (float& sample : row) sample = uniform(generator);
    }
    for (float& weight : weights_) weight = uniform(generator) / kMostPairs;
    for (int i = 0; i < kRows; ++i) rows_[i] = samples_[i].data() + kMargin;
  }

  const float* const* middle() const { return &rows_[kMostPairs]; }

  float sum_at(const float* const* rows, int shift, int x) const {
    double sum = 0;
    for (int i = 0; i < pairs_; ++i)
      sum += static_cast<double>(weights_[i]) * (rows[-i][x] + rows[i + shift][x]);
    return static_cast<float>(sum);
  }

  const SiftSums& sums_;
  int pairs_;
  float weights_[kMostPairs];
  std::vector<float> samples_[kRows];
  const float* rows_[kRows];
  float out_[kWidth] = {}, out_below_[kWidth] = {};
};

TEST_P(SiftSumsTest, WeighsPairsOfRows) {
  for (const int shift : {0, 1}) {
    sums_.rows(middle(), shift, weights_, pairs_, kPlaneBlock, 2 * kPlaneBlock, out_);
    for (int x = kPlaneBlock; x < 2 * kPlaneBlock; ++x)
      ASSERT_NEAR(out_[x], sum_at(middle(), shift, x), kRounding) << x;
  }
  EXPECT_EQ(out_[kPlaneBlock - 1], 0) << "not asked for";
  EXPECT_EQ(out_[2 * kPlaneBlock], 0) << "not asked for";
}

TEST_P(SiftSumsTest, TwoRowsAtOnceAreWhatEachIsAlone) {
  sums_.two_rows(middle(), weights_, pairs_, 0, kWidth, out_, out_below_);
  float alone[kWidth], below_alone[kWidth];
  sums_.rows(middle(), 0, weights_, pairs_, 0, kWidth, alone);
  sums_.rows(middle() + 1, 0, weights_, pairs_, 0, kWidth, below_alone);
  for (int x = 0; x < kWidth; ++x) {
    ASSERT_EQ(out_[x], alone[x]) << x;
    ASSERT_EQ(out_below_[x], below_alone[x]) << x;
  }
}

TEST_P(SiftSumsTest, WeighsPairsOfSamplesAlongARow) {
  const float* row = middle()[0];
  for (const int shift : {0, 1}) {
    sums_.samples(row, shift, weights_, pairs_, kWidth, out_);
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0;
      for (int i = 0; i < pairs_; ++i)
        sum += static_cast<double>(weights_[i]) * (row[x - i] + row[x + i + shift]);
      ASSERT_NEAR(out_[x], sum, kRounding) << x;
    }
  }
}

std::vector<Instructions> those_of_this_processor() {
  std::vector<Instructions> all;
  for (const Instructions i : {Instructions::kAny, Instructions::kAvx2, Instructions::kAvx512}) {
    if (i <= SiftSums::best_instructions()) all.push_back(i);
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Instructions, SiftSumsTest,
                         testing::Combine(testing::ValuesIn(those_of_this_processor()),
                                          testing::Values(1, 5, 14, 16, kMostPairs)));

// A wider vector adds in the same order.
TEST(SiftSums, Avx512GivesWhatAvx2Gives) {
  if (SiftSums::best_instructions() < Instructions::kAvx512) GTEST_SKIP() << "no AVX-512 here";
  std::mt19937 generator(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  float row[kMargin + kWidth + kMargin + kPlaneBlock], weights[kMostPairs], wide[kWidth], narrow[kWidth];
  for (float& sample : row) sample = uniform(generator);
  for (float& weight : weights) weight = uniform(generator);
  SiftSums::of(Instructions::kAvx512).samples(row + kMargin, 1, weights, 14, kWidth, wide);
  SiftSums::of(Instructions::kAvx2).samples(row + kMargin, 1, weights, 14, kWidth, narrow);
  for (int x = 0; x < kWidth; ++x) ASSERT_EQ(wide[x], narrow[x]) << x;
}

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
