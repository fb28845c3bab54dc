#include "features/sift_scale_space.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {
namespace {

double pixels_of(const cv::Size& image) { return static_cast<double>(image.width) * image.height; }

double searched_pixels(const cv::Size& image, const SiftScale& scale) {
  return pixels_of(image) / (scale.pixel_size() * scale.pixel_size());
}

int choose_reduction(const cv::Size& image, SearchPace pace, const LiveSearchOptions& live) {
  const double pixels = pixels_of(image);
  if (pace == SearchPace::kRecording || pixels <= live.most_pixels) return 1;
  return static_cast<int>(std::ceil(std::sqrt(pixels / live.pixels_of_a_thread)));
}

float usual_sigma(const SiftScale& scale) {
  if (scale.first_octave > 0 || scale.reduction > 1) return 1.0f;
  return scale.first_octave < 0 ? 1.6f : 1.2f;
}

}  // namespace

SiftScale choose_sift_scale(const SiftOptions& options, const cv::Size& image, SearchPace pace,
                            const LiveSearchOptions& live) {
  SiftScale scale;
  scale.first_octave = options.first_octave.value_or(0);
  scale.reduction = options.first_octave ? options.reduction : choose_reduction(image, pace, live);
  scale.sigma = options.sigma ? *options.sigma : usual_sigma(scale);
  return scale;
}

bool is_small_object(double object_px, const SiftScale& scale) {
  return object_px > 0 && object_px < kSmallObject * feature_pixel_size(scale);
}

SiftScale finer(const SiftScale& scale) {
  SiftScale result = scale;
  if (scale.reduction > 1) {
    result.reduction = (scale.reduction + 1) / 2;
  } else {
    result.first_octave = std::max(scale.first_octave - 1, kFinestOctave);
  }
  result.sigma = usual_sigma(result);
  return result;
}

int choose_sift_threads(const SiftOptions& options, const SiftScale& scale, const cv::Size& image,
                        SearchPace pace, int cores, const LiveSearchOptions& live) {
  if (options.num_threads > 0) return options.num_threads;
  if (pace == SearchPace::kRecording) return 1;
  const double work = searched_pixels(image, scale) + pixels_of(image) / live.read_in_time_of_search;
  const int wanted = static_cast<int>(std::ceil(work / live.pixels_of_a_thread));
  return std::clamp(wanted, 1, std::max(cores, 1));
}

double feature_pixel_size(const SiftScale& scale) { return std::max(scale.pixel_size(), 1.0); }

namespace {

float added_sigma(float from, float to) { return std::sqrt(std::max(to * to - from * from, 0.01f)); }

void halve(const Plane& in, Plane* out) {
  out->resize((in.width() + 1) / 2, (in.height() + 1) / 2);
  for (int y = 0; y < out->height(); ++y) {
    const float* from = in.row(2 * y);
    float* to = out->row(y);
    for (int x = 0; x < out->width(); ++x) to[x] = from[2 * x];
  }
}

}  // namespace

ScaleSpace::ScaleSpace(const SiftOptions& options, const SiftScale& scale, const ScaleSpaceOptions& limits)
    : options_(options), limits_(limits), filters_(options.num_threads) {
  set_scale(scale);
}

void ScaleSpace::set_scale(const SiftScale& scale) {
  scale_ = scale;
  octaves_ = 0;
  level_kernels_.clear();
  reductions_.clear();
  for (int level = 1; level < layers() + 3; ++level) {
    level_kernels_.push_back(gaussian_kernel(
        added_sigma(sigma_of_level(level - 1.0f), sigma_of_level(static_cast<float>(level)))));
  }
  if (scale_.first_octave < 0) {
    const float sigma = 0.5f * scale_.sigma;
    base_kernel_ = gaussian_kernel(sigma);
    base_kernel_between_ = gaussian_kernel(sigma, true);
    return;
  }
  float blurred = 0;  // px of what has been reduced so far
  const auto reduce = [&](int step) {
    reductions_.emplace_back(
        gaussian_kernel(added_sigma(blurred, static_cast<float>(step) * limits_.reduced_sigma)), step);
    blurred = limits_.reduced_sigma;
  };
  if (scale_.reduction > 1) reduce(scale_.reduction);
  for (int octave = 0; octave < scale_.first_octave; ++octave) reduce(2);
  base_kernel_ = gaussian_kernel(added_sigma(blurred, scale_.sigma));
}

float ScaleSpace::pixel_size(int octave) const {
  return static_cast<float>(std::ldexp(scale_.pixel_size(), octave));
}

float ScaleSpace::sigma_of_level(float level) const {
  return scale_.sigma * std::exp2(level / static_cast<float>(layers()));
}

void ScaleSpace::build(const cv::Mat& gray, const RowsMade& rows_made) {
  octaves_ = 0;
  const float scale = 1.0f / pixel_size(0);
  float side = scale * std::min(gray.cols, gray.rows);
  while (side >= limits_.smallest_octave) {
    ++octaves_;
    side *= 0.5f;
  }
  const std::size_t planes = static_cast<std::size_t>(octaves_) * (layers() + 3);
  if (planes_.size() < planes) planes_.resize(planes);
  if (octaves_ == 0) return;

  build_base(gray);
  for (int octave = 0; octave < octaves_; ++octave) {
    if (octave > 0) halve(gaussian(octave - 1, layers()), &planes_[octave * (layers() + 3)]);
    if (make_levels(octave, rows_made)) continue;
    octaves_ = octave;  // those that are whole
    return;
  }
}

// All levels go down the octave together, each as far behind the one before as its kernel reaches. False when
// it was cancelled.
bool ScaleSpace::make_levels(int octave, const RowsMade& rows_made) {
  Plane* levels = &planes_[octave * (layers() + 3)];
  const int height = levels[0].height();
  for (int level = 1; level < layers() + 3; ++level) levels[level].resize(levels[0].width(), height);
  std::vector<int>& made = made_;
  made.assign(layers() + 3, 0);  // the first is there, and taken a step at a time
  const int threads = options_.num_threads;
  const int step = threads == 1 ? limits_.rows_of_one_thread : limits_.rows_of_each_thread * threads;
  while (made.back() < height) {
    if (is_set(options_.cancelled)) return false;
    const int begin = made.back();
    made[0] = std::min(made[0] + step, height);
    for (int level = 1; level < layers() + 3; ++level) {
      const PairKernel& kernel = level_kernels_[level - 1];
      const int before = made[level - 1];
      const int end = before == height ? height : std::max(made[level], before - kernel.reach() + 1);
      blur_rows(levels[level - 1], kernel, 1, made[level], end, &levels[level]);
      made[level] = end;
    }
    if (made.back() > begin) rows_made(octave, begin, made.back());
  }
  return true;
}

void ScaleSpace::build_base(const cv::Mat& gray) {
  input_.resize(gray.cols, gray.rows);
  for_parts(gray.rows, options_.num_threads, [&](int, int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const std::uint8_t* from = gray.ptr<std::uint8_t>(y);
      float* to = input_.row(y);
      for (int x = 0; x < gray.cols; ++x) to[x] = static_cast<float>(from[x]) * (1.0f / 255.0f);
    }
  });
  if (scale_.first_octave < 0) {
    build_doubled_base(&planes_[0]);
    return;
  }
  for (const auto& [kernel, step] : reductions_) reduce_input(kernel, step);
  blur(input_, base_kernel_, 1, &planes_[0]);
}

// Doubles and blurs in one step: the Gaussian is sampled at whole and half pixels of the input.
// (Interpolating linearly first blurs the pixels in between more than the others, which pulls key points
// towards the grid.)
void ScaleSpace::build_doubled_base(Plane* base) {
  base->resize(2 * input_.width() - 1, 2 * input_.height() - 1);
  for_parts(base->height(), options_.num_threads, [&](int part, int begin, int end) {
    filters_[part].filter_doubled(input_, base_kernel_, base_kernel_between_, begin, end, base);
  });
}

// Every so many-th pixel of every so many-th row of the input, blurred, takes its place.
void ScaleSpace::reduce_input(const PairKernel& kernel, int step) {
  blur(input_, kernel, step, &smoothed_);
  input_.resize((smoothed_.width() + step - 1) / step, smoothed_.height());
  for_parts(input_.height(), options_.num_threads, [&](int, int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const float* from = smoothed_.row(y);
      float* to = input_.row(y);
      for (int x = 0; x < input_.width(); ++x) to[x] = from[step * x];
    }
  });
}

// Row y of the output is row y * row_step of the input, blurred.
void ScaleSpace::blur(const Plane& in, const PairKernel& kernel, int row_step, Plane* out) {
  out->resize(in.width(), (in.height() + row_step - 1) / row_step);
  blur_rows(in, kernel, row_step, 0, out->height(), out);
}

void ScaleSpace::blur_rows(const Plane& in, const PairKernel& kernel, int row_step, int begin, int end,
                           Plane* out) {
  for_parts(end - begin, options_.num_threads, [&](int part, int from, int to) {
    filters_[part].filter(in, kernel, row_step, begin + from, begin + to, out);
  });
}

}  // namespace mono_pose_tracker
