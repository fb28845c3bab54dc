#include "sift_gaussian.h"

#include <algorithm>
#include <cmath>

#include "common/toolchain.h"
#include "sift_plane.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define MPT_SIFT_FOR_X86 1
#define MPT_SIFT_AVX2 __attribute__((target("avx2,fma")))
#define MPT_SIFT_AVX512 __attribute__((target("avx512f,avx2,fma")))
#endif

// Each loop is written once for vectors of any width and compiled into a function for each: the compiler
// makes a vector wider than the processor's go through memory, ten times as slow.
#define MPT_SIFT_INLINE __attribute__((always_inline)) inline

namespace mono_pose_tracker {
namespace {

// Not by one template: attributes that depend on its argument may be ignored.
template <int kFloats>
struct VectorOf;
template <>
struct VectorOf<4> {
  using Type = Floats4;
  using Unaligned = UnalignedFloats4;
};
template <>
struct VectorOf<8> {
  using Type = Floats8;
  using Unaligned = UnalignedFloats8;
};
template <>
struct VectorOf<16> {
  using Type = Floats16;
  using Unaligned = UnalignedFloats16;
};

template <int kFloats>
using Vector = typename VectorOf<kFloats>::Type;

#define MPT_SIFT_LOAD_OF(floats, pointer) \
  (*reinterpret_cast<const typename VectorOf<floats>::Unaligned*>(pointer))
#define MPT_SIFT_STORE_OF(floats, pointer, value) \
  (*reinterpret_cast<typename VectorOf<floats>::Unaligned*>(pointer) = (value))

// kVectors at a time, whose sums do not wait for each other. before(i) and behind(i): where the samples of
// pair i begin.
template <int kFloats, int kVectors, typename Before, typename Behind>
MPT_SIFT_INLINE void sum_pairs(const Before& before, const Behind& behind, const float* weights, int pairs,
                               int begin, int end, float* __restrict out) {
  constexpr int kStep = kFloats * kVectors;
  static_assert(kPlaneBlock % kStep == 0);
  for (int x = begin; x < end; x += kStep) {
    Vector<kFloats> sum[kVectors] = {};
    for (int i = 0; i < pairs; ++i) {
      const float* a = before(i) + x;
      const float* b = behind(i) + x;
      const float weight = weights[i];
#pragma GCC unroll 8
      for (int k = 0; k < kVectors; ++k) {
        sum[k] += weight *
                  (MPT_SIFT_LOAD_OF(kFloats, a + kFloats * k) + MPT_SIFT_LOAD_OF(kFloats, b + kFloats * k));
      }
    }
#pragma GCC unroll 8
    for (int k = 0; k < kVectors; ++k) MPT_SIFT_STORE_OF(kFloats, out + x + kFloats * k, sum[k]);
  }
}

template <int kFloats, int kVectors>
MPT_SIFT_INLINE void sum_rows(const float* const* rows, int shift, const float* weights, int pairs, int begin,
                              int end, float* out) {
  sum_pairs<kFloats, kVectors>([rows](int i) { return rows[-i]; },
                               [rows, shift](int i) { return rows[i + shift]; }, weights, pairs, begin, end,
                               out);
}

template <int kFloats, int kVectors>
MPT_SIFT_INLINE void sum_samples(const float* row, int shift, const float* weights, int pairs, int width,
                                 float* out) {
  sum_pairs<kFloats, kVectors>([row](int i) { return row - i; },
                               [row, shift](int i) { return row + i + shift; }, weights, pairs, 0, width,
                               out);
}

// What is above the row at one step is above the one below it at the next, and the other way below.
template <int kFloats, int kVectors>
MPT_SIFT_INLINE void sum_two_rows(const float* const* rows, const float* weights, int pairs, int begin,
                                  int end, float* __restrict out, float* __restrict out_below) {
  constexpr int kStep = kFloats * kVectors;
  static_assert(kPlaneBlock % kStep == 0);
  for (int x = begin; x < end; x += kStep) {
    Vector<kFloats> sum[kVectors] = {}, sum_below[kVectors] = {}, last_above[kVectors], last_below[kVectors];
#pragma GCC unroll 8
    for (int k = 0; k < kVectors; ++k) {
      last_below[k] = MPT_SIFT_LOAD_OF(kFloats, rows[0] + x + kFloats * k);
      last_above[k] = MPT_SIFT_LOAD_OF(kFloats, rows[1] + x + kFloats * k);
    }
    for (int i = 0; i < pairs; ++i) {
      const float weight = weights[i];
#pragma GCC unroll 8
      for (int k = 0; k < kVectors; ++k) {
        const Vector<kFloats> above = MPT_SIFT_LOAD_OF(kFloats, rows[-i] + x + kFloats * k);
        const Vector<kFloats> below = MPT_SIFT_LOAD_OF(kFloats, rows[i + 1] + x + kFloats * k);
        sum[k] += weight * (above + last_below[k]);
        sum_below[k] += weight * (last_above[k] + below);
        last_above[k] = above;
        last_below[k] = below;
      }
    }
#pragma GCC unroll 8
    for (int k = 0; k < kVectors; ++k) {
      MPT_SIFT_STORE_OF(kFloats, out + x + kFloats * k, sum[k]);
      MPT_SIFT_STORE_OF(kFloats, out_below + x + kFloats * k, sum_below[k]);
    }
  }
}

// The numbers of vectors are the fastest of those tried: with more the sums no longer fit the registers.
void rows_of_any(const float* const* rows, int shift, const float* weights, int pairs, int begin, int end,
                 float* out) {
  sum_rows<4, 8>(rows, shift, weights, pairs, begin, end, out);
}
void two_rows_of_any(const float* const* rows, const float* weights, int pairs, int begin, int end,
                     float* out, float* out_below) {
  sum_two_rows<4, 2>(rows, weights, pairs, begin, end, out, out_below);
}
void samples_of_any(const float* row, int shift, const float* weights, int pairs, int width, float* out) {
  sum_samples<4, 8>(row, shift, weights, pairs, width, out);
}

#ifdef MPT_SIFT_FOR_X86
MPT_SIFT_AVX2 void rows_of_avx2(const float* const* rows, int shift, const float* weights, int pairs,
                                int begin, int end, float* out) {
  sum_rows<8, 8>(rows, shift, weights, pairs, begin, end, out);
}
MPT_SIFT_AVX2 void two_rows_of_avx2(const float* const* rows, const float* weights, int pairs, int begin,
                                    int end, float* out, float* out_below) {
  sum_two_rows<8, 2>(rows, weights, pairs, begin, end, out, out_below);
}
MPT_SIFT_AVX2 void samples_of_avx2(const float* row, int shift, const float* weights, int pairs, int width,
                                   float* out) {
  sum_samples<8, 8>(row, shift, weights, pairs, width, out);
}

MPT_SIFT_AVX512 void rows_of_avx512(const float* const* rows, int shift, const float* weights, int pairs,
                                    int begin, int end, float* out) {
  sum_rows<16, 4>(rows, shift, weights, pairs, begin, end, out);
}
MPT_SIFT_AVX512 void two_rows_of_avx512(const float* const* rows, const float* weights, int pairs, int begin,
                                        int end, float* out, float* out_below) {
  sum_two_rows<16, 4>(rows, weights, pairs, begin, end, out, out_below);
}

// A load of 64 bytes that are not aligned takes two of the cache: what lies before x is put together from
// vectors that are in registers, while what lies behind is loaded.
MPT_SIFT_AVX512 void samples_of_avx512(const float* row, int shift, const float* weights, int pairs,
                                       int width, float* __restrict out) {
  if (pairs > kSumsMargin) return sum_samples<16, 4>(row, shift, weights, pairs, width, out);
  const __m512i here = _mm512_set_epi32(31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16);
  const __m512i one = _mm512_set1_epi32(1);
  for (int x = 0; x < width; x += 64) {
    const __m512 before = _mm512_loadu_ps(row + x - 16);
    const __m512 row0 = _mm512_loadu_ps(row + x), row1 = _mm512_loadu_ps(row + x + 16);
    const __m512 row2 = _mm512_loadu_ps(row + x + 32), row3 = _mm512_loadu_ps(row + x + 48);
    __m512 sum0 = _mm512_setzero_ps(), sum1 = sum0, sum2 = sum0, sum3 = sum0;
    const float* behind = row + x + shift;
    __m512i samples = here;  // of two vectors, one after the other
    for (int i = 0; i < pairs; ++i, ++behind, samples = _mm512_sub_epi32(samples, one)) {
      const __m512 weight = _mm512_set1_ps(weights[i]);
      const __m512 a0 = _mm512_permutex2var_ps(before, samples, row0);
      const __m512 a1 = _mm512_permutex2var_ps(row0, samples, row1);
      const __m512 a2 = _mm512_permutex2var_ps(row1, samples, row2);
      const __m512 a3 = _mm512_permutex2var_ps(row2, samples, row3);
      sum0 += weight * (a0 + _mm512_loadu_ps(behind));
      sum1 += weight * (a1 + _mm512_loadu_ps(behind + 16));
      sum2 += weight * (a2 + _mm512_loadu_ps(behind + 32));
      sum3 += weight * (a3 + _mm512_loadu_ps(behind + 48));
    }
    _mm512_storeu_ps(out + x, sum0);
    _mm512_storeu_ps(out + x + 16, sum1);
    _mm512_storeu_ps(out + x + 32, sum2);
    _mm512_storeu_ps(out + x + 48, sum3);
  }
}
#endif

}  // namespace

SiftSums::Instructions SiftSums::best_instructions() {
#ifdef MPT_SIFT_FOR_X86
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return Instructions::kAny;
  return __builtin_cpu_supports("avx512f") ? Instructions::kAvx512 : Instructions::kAvx2;
#else
  return Instructions::kAny;
#endif
}

const SiftSums& SiftSums::of(Instructions instructions) {
  static constexpr SiftSums kSums[] = {
      {rows_of_any, two_rows_of_any, samples_of_any},
#ifdef MPT_SIFT_FOR_X86
      {rows_of_avx2, two_rows_of_avx2, samples_of_avx2},
      {rows_of_avx512, two_rows_of_avx512, samples_of_avx512},
#endif
  };
  return kSums[static_cast<int>(std::min(instructions, best_instructions()))];
}

namespace {

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

PairKernel gaussian_kernel(float sigma, bool between_samples, float reach_in_sigmas) {
  PairKernel kernel;
  kernel.between_samples = between_samples;
  const double first = between_samples ? 0.5 : 0.0;
  const int pairs = static_cast<int>(std::ceil(reach_in_sigmas * sigma - first)) + 1;
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
