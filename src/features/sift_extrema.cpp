#include "sift_extrema.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "common/toolchain.h"
#include "sift_plane.h"
#include "sift_scale_space.h"

namespace mono_pose_tracker {
namespace {

MPT_FUNCTION_CLONES
void subtract_rows(const float* a, const float* b, int width, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = a[x] - b[x];
}

// A row of a difference image with its neighbours above, below, and the same row one level finer and coarser.
struct RowNeighbourhood {
  const float* row;
  const float* above;
  const float* below;
  const float* finer;
  const float* coarser;
};

using Longs4 = long long __attribute__((vector_size(32)));

// Writes each x at which the sample is beyond the threshold and no neighbour within the row, above, below,
// finer or coarser exceeds it. Returns how many. Reads to the end of the block that holds end - 1.
MPT_FUNCTION_CLONES
int find_candidates(const RowNeighbourhood& rows, float threshold, int begin, int end, int* candidates) {
  constexpr int kGroup = 32;  // most of which, in most images, hold no sample beyond the threshold
  int count = 0;
  for (int group = begin; group < end; group += kGroup) {
    Ints8 strong = {};
    for (int x = group; x < group + kGroup; x += 8) {
      const Floats8 v = MPT_SIFT_LOAD(rows.row + x);
      strong |= (v > threshold) | (v < -threshold);
    }
    const Longs4 strong_pairs = reinterpret_cast<Longs4>(strong);
    if ((strong_pairs[0] | strong_pairs[1] | strong_pairs[2] | strong_pairs[3]) == 0) continue;
    for (int x = group; x < group + kGroup; x += 8) {
      const Floats8 v = MPT_SIFT_LOAD(rows.row + x);
      const Floats8 left = MPT_SIFT_LOAD(rows.row + x - 1), right = MPT_SIFT_LOAD(rows.row + x + 1);
      const Floats8 above = MPT_SIFT_LOAD(rows.above + x), below = MPT_SIFT_LOAD(rows.below + x);
      const Floats8 finer = MPT_SIFT_LOAD(rows.finer + x), coarser = MPT_SIFT_LOAD(rows.coarser + x);
      const Ints8 high = (v > threshold) & (v >= left) & (v >= right) & (v >= above) & (v >= below) &
                         (v >= finer) & (v >= coarser);
      const Ints8 low = (v < -threshold) & (v <= left) & (v <= right) & (v <= above) & (v <= below) &
                        (v <= finer) & (v <= coarser);
      const Ints8 any = high | low;
      const Longs4 pairs = reinterpret_cast<Longs4>(any);
      if ((pairs[0] | pairs[1] | pairs[2] | pairs[3]) == 0) continue;
      for (int i = 0; i < 8 && x + i < end; ++i) {
        if (any[i]) candidates[count++] = x + i;
      }
    }
  }
  return count;
}

bool is_extremum(const float* const* three_rows_of_three_levels, int x) {
  const float v = three_rows_of_three_levels[4][x];
  const float sign = v > 0 ? 1.0f : -1.0f;
  for (int i = 0; i < 9; ++i) {
    const float* row = three_rows_of_three_levels[i] + x;
    if (sign * row[-1] > sign * v || sign * row[0] > sign * v || sign * row[1] > sign * v) return false;
  }
  return true;
}

// The 27 differences around a sample of level (1: the second difference image) and their quadratic fit.
class Neighbourhood {
 public:
  Neighbourhood(const ScaleSpace& space, int octave, int level, int x, int y) {
    for (int s = 0; s < 3; ++s) {
      for (int r = 0; r < 3; ++r) {
        const float* fine = space.gaussian(octave, level + s - 1).row(y + r - 1) + x - 1;
        const float* coarse = space.gaussian(octave, level + s).row(y + r - 1) + x - 1;
        for (int c = 0; c < 3; ++c) d_[s][r][c] = coarse[c] - fine[c];
      }
    }
  }
  float value() const { return d_[1][1][1]; }
  Eigen::Vector3f gradient() const {  // along x, y, level
    return 0.5f *
           Eigen::Vector3f(d_[1][1][2] - d_[1][1][0], d_[1][2][1] - d_[1][0][1], d_[2][1][1] - d_[0][1][1]);
  }
  Eigen::Matrix3f hessian() const {
    const float v2 = 2 * value();
    const float xx = d_[1][1][2] + d_[1][1][0] - v2;
    const float yy = d_[1][2][1] + d_[1][0][1] - v2;
    const float ss = d_[2][1][1] + d_[0][1][1] - v2;
    const float xy = 0.25f * (d_[1][2][2] - d_[1][2][0] - d_[1][0][2] + d_[1][0][0]);
    const float xs = 0.25f * (d_[2][1][2] - d_[2][1][0] - d_[0][1][2] + d_[0][1][0]);
    const float ys = 0.25f * (d_[2][2][1] - d_[2][0][1] - d_[0][2][1] + d_[0][0][1]);
    Eigen::Matrix3f h;
    h << xx, xy, xs, xy, yy, ys, xs, ys, ss;
    return h;
  }

  // The peak again, from the joint fit's offset: in turns x and y in the plane at that level, level at that x
  // and y. Where the scale lies between two levels x and y come out several times as accurate as from the
  // joint fit.
  Eigen::Vector3f settled_offset(Eigen::Vector3f offset) const {
    for (int turn = 0; turn < 2; ++turn) {
      offset.head<2>() = offset_in_plane(offset.z());
      offset.z() = level_offset_at(offset.head<2>());
    }
    return offset;
  }

 private:
  struct PlaneFit {
    float value;
    Eigen::Vector2f gradient;
    Eigen::Matrix2f hessian;
  };

  static PlaneFit fit_plane(const float p[3][3]) {
    PlaneFit fit;
    fit.value = p[1][1];
    fit.gradient = 0.5f * Eigen::Vector2f(p[1][2] - p[1][0], p[2][1] - p[0][1]);
    const float xy = 0.25f * (p[2][2] - p[2][0] - p[0][2] + p[0][0]);
    fit.hessian << p[1][2] + p[1][0] - 2 * p[1][1], xy, xy, p[2][1] + p[0][1] - 2 * p[1][1];
    return fit;
  }

  // The difference of Gaussians of a blob is (1 - u) exp(-u), u = r^2 / 2t: its fourth root is a parabola up
  // to r^6, where itself it is one only up to r^4, and the fit to it pulls by up to 0.08 px.
  static void straighten_peak(float p[3][3]) {
    const float sign = p[1][1] > 0 ? 1.0f : -1.0f;
    for (int i = 0; i < 9; ++i) {
      if (sign * p[i / 3][i % 3] <= 0) return;
    }
    for (int i = 0; i < 9; ++i) p[i / 3][i % 3] = sign * std::sqrt(std::sqrt(sign * p[i / 3][i % 3]));
  }

  Eigen::Vector2f offset_in_plane(float level_offset) const {
    float p[3][3];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        const float slope = 0.5f * (d_[2][r][c] - d_[0][r][c]);
        const float curvature = d_[2][r][c] + d_[0][r][c] - 2 * d_[1][r][c];
        p[r][c] = d_[1][r][c] + level_offset * (slope + 0.5f * level_offset * curvature);
      }
    }
    straighten_peak(p);
    const PlaneFit fit = fit_plane(p);
    return -(fit.hessian.inverse() * fit.gradient);
  }

  float level_offset_at(const Eigen::Vector2f& offset) const {
    float v[3];
    for (int s = 0; s < 3; ++s) {
      const PlaneFit fit = fit_plane(d_[s]);
      v[s] = fit.value + offset.dot(fit.gradient + 0.5f * (fit.hessian * offset));
    }
    return 0.5f * (v[0] - v[2]) / (v[0] - 2 * v[1] + v[2]);
  }

  float d_[3][3][3];
};

bool is_on_edge(const Eigen::Matrix3f& hessian, float edge_threshold) {
  const float trace = hessian(0, 0) + hessian(1, 1);
  const float determinant = hessian(0, 0) * hessian(1, 1) - hessian(0, 1) * hessian(0, 1);
  const float r = edge_threshold;
  return determinant <= 0 || trace * trace * r >= (r + 1) * (r + 1) * determinant;
}

// Section 4: steps to the sample nearest to the fitted extremum; false when it leaves the octave, does not
// settle, is of low contrast or on an edge.
bool refine_extremum(const ScaleSpace& space, const SiftOptions& options, const ExtremaOptions& limits,
                     float contrast_threshold, int octave, int level, int x, int y, Extremum* extremum) {
  const Plane& plane = space.gaussian(octave, 0);
  for (int step = 0; step < limits.max_steps; ++step) {
    const Neighbourhood neighbourhood(space, octave, level, x, y);
    const Eigen::Vector3f gradient = neighbourhood.gradient();
    const Eigen::Matrix3f hessian = neighbourhood.hessian();
    const Eigen::Vector3f offset = -(hessian.inverse() * gradient);
    if (!offset.allFinite() || offset.cwiseAbs().maxCoeff() > static_cast<float>(plane.width())) return false;
    if (offset.cwiseAbs().maxCoeff() <= limits.max_offset) {
      const float contrast = std::abs(neighbourhood.value() + 0.5f * gradient.dot(offset));
      if (contrast * options.octave_layers < contrast_threshold) return false;
      if (is_on_edge(hessian, options.edge_threshold)) return false;
      const Eigen::Vector3f settled = neighbourhood.settled_offset(offset);
      if (!(settled.cwiseAbs().maxCoeff() <= 1.0f)) return false;  // px and levels: no peak there after all
      extremum->octave = octave;
      extremum->level = level;
      extremum->x = x + settled.x();
      extremum->y = y + settled.y();
      extremum->sigma = space.sigma_of_level(level + settled.z());
      const float pixel_size = space.pixel_size(octave);
      extremum->feature.pixel = pixel_size * Eigen::Vector2f(extremum->x, extremum->y);
      extremum->feature.scale = pixel_size * extremum->sigma;
      extremum->feature.response = contrast;
      return true;
    }
    x += cvRound(offset.x());
    y += cvRound(offset.y());
    level += cvRound(offset.z());
    if (level < 1 || level > options.octave_layers || x < limits.border ||
        x >= plane.width() - limits.border || y < limits.border || y >= plane.height() - limits.border) {
      return false;
    }
  }
  return false;
}

}  // namespace

float ExtremaFinder::sample_threshold(float contrast_threshold) const {
  return limits_.sample_contrast_share * contrast_threshold / static_cast<float>(options_.octave_layers);
}

void ExtremaFinder::begin(float contrast_threshold) {
  contrast_threshold_ = contrast_threshold;
  samples_.clear();
}

void ExtremaFinder::look_at(const ScaleSpace& space, int octave, int begin, int end) {
  // An extremum lies between two rows.
  const int first = std::max(begin - 1, limits_.border);
  const int last = std::min(end - 1, space.gaussian(octave, 0).height() - limits_.border);
  if (last <= first) return;
  for_parts(last - first, options_.num_threads, [&](int part, int from, int to) {
    parts_[part].samples.clear();
    if (from < to) look_at_rows(space, octave, first + from, first + to, &parts_[part]);
  });
  for (const Part& part : parts_) samples_.insert(samples_.end(), part.samples.begin(), part.samples.end());
}

void ExtremaFinder::look_at_rows(const ScaleSpace& space, int octave, int begin, int end, Part* part) const {
  const int stride = space.gaussian(octave, 0).stride();
  const int padded_width = space.gaussian(octave, 0).padded_width();
  const int width = space.gaussian(octave, 0).width();
  const int differences = space.layers() + 2;
  const float threshold = sample_threshold(contrast_threshold_);
  const std::size_t size = static_cast<std::size_t>(3) * differences * stride + kPlaneBlock;
  if (part->differences.size() < size) part->differences.resize(size);
  part->candidates.resize(stride);
  const auto ring_row = [&](int d, int y) { return part->differences.data() + (3 * d + y % 3) * stride; };
  const auto subtract = [&](int y) {
    for (int d = 0; d < differences; ++d) {
      subtract_rows(space.gaussian(octave, d + 1).row(y), space.gaussian(octave, d).row(y), padded_width,
                    ring_row(d, y));
    }
  };

  for (int y = begin - 1; y < begin + 1; ++y) subtract(y);
  for (int y = begin; y < end && !is_set(options_.cancelled); ++y) {
    subtract(y + 1);
    for (int level = 1; level <= space.layers(); ++level) {
      const float* rows[9];
      for (int i = 0; i < 9; ++i) rows[i] = ring_row(level + i / 3 - 1, y + i % 3 - 1);
      const int candidates = find_candidates({rows[4], rows[3], rows[5], rows[1], rows[7]}, threshold,
                                             limits_.border, width - limits_.border, part->candidates.data());
      for (int i = 0; i < candidates; ++i) {
        const int x = part->candidates[i];
        if (is_extremum(rows, x)) part->samples.push_back({octave, level, x, y, std::abs(rows[4][x])});
      }
    }
  }
}

void ExtremaFinder::refine(const ScaleSpace& space, float contrast_threshold,
                           std::vector<Extremum>* extrema) {
  const float threshold = sample_threshold(contrast_threshold);
  for_parts(static_cast<int>(samples_.size()), options_.num_threads, [&](int part, int begin, int end) {
    parts_[part].extrema.clear();
    for (int i = begin; i < end && !is_set(options_.cancelled); ++i) {
      const Sample& s = samples_[i];
      Extremum extremum;
      if (s.contrast > threshold && s.octave < space.octaves() &&
          refine_extremum(space, options_, limits_, contrast_threshold, s.octave, s.level, s.x, s.y,
                          &extremum)) {
        parts_[part].extrema.push_back(extremum);
      }
    }
  });
  extrema->clear();
  for (const Part& part : parts_) extrema->insert(extrema->end(), part.extrema.begin(), part.extrema.end());
}

}  // namespace mono_pose_tracker
