#include "features/sift_scale.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {
namespace {

// px that are searched. SIFT's time grows with them and leaves a frame of 33 ms on two cores the time for the
// rest up to twice the size that most cameras are sold for (640x480).
constexpr double kMostSearchedPixels = 2 * 640 * 480;

// px that one thread is to search: 640x480, and cameras with a little more.
constexpr double kPixelsOfAThread = 1.25 * 640 * 480;

// px that are read and reduced in the time that it takes to search one.
constexpr double kReadInTimeOfSearch = 30;

double pixels_of(const cv::Size& image) { return static_cast<double>(image.width) * image.height; }

double searched_pixels(const cv::Size& image, const SiftScale& scale) {
  return pixels_of(image) / (scale.pixel_size() * scale.pixel_size());
}

int choose_reduction(const cv::Size& image, SearchPace pace) {
  const double pixels = pixels_of(image);
  if (pace == SearchPace::kRecording || pixels <= kMostSearchedPixels) return 1;
  return static_cast<int>(std::ceil(std::sqrt(pixels / kPixelsOfAThread)));
}

float usual_sigma(const SiftScale& scale) {
  if (scale.first_octave > 0 || scale.reduction > 1) return 1.0f;
  return scale.first_octave < 0 ? 1.6f : 1.2f;
}

}  // namespace

SiftScale choose_sift_scale(const SiftOptions& options, const cv::Size& image, SearchPace pace) {
  SiftScale scale;
  scale.first_octave = options.first_octave.value_or(0);
  scale.reduction = options.first_octave ? options.reduction : choose_reduction(image, pace);
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
                        SearchPace pace, int cores) {
  if (options.num_threads > 0) return options.num_threads;
  if (pace == SearchPace::kRecording) return 1;
  const double work = searched_pixels(image, scale) + pixels_of(image) / kReadInTimeOfSearch;
  const int wanted = static_cast<int>(std::ceil(work / kPixelsOfAThread));
  return std::clamp(wanted, 1, std::max(cores, 1));
}

double feature_pixel_size(const SiftScale& scale) { return std::max(scale.pixel_size(), 1.0); }

}  // namespace mono_pose_tracker
