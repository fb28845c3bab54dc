#include "mono_pose_tracker/features/sift_scale.h"

#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {
namespace {

// px of the first octave. SIFT's time grows with it and leaves a frame of 33 ms on two cores the time for the
// rest up to twice the size that most cameras are sold for (640x480).
constexpr double kMostSearchedPixels = 2 * 640 * 480;

// px of the first octave that one thread is to search: 640x480, and cameras with a little more.
constexpr double kPixelsOfAThread = 1.2 * 640 * 480;

double searched_pixels(const cv::Size& image, int octave) {
  return static_cast<double>(image.width) * image.height * std::exp2(-2.0 * octave);
}

int choose_octave(const cv::Size& image, double object_px, SearchPace pace) {
  const bool is_live = pace == SearchPace::kLive;
  const bool is_object = object_px > 0;
  const double whole = static_cast<double>(image.width) * image.height;
  // Blurring the whole image is what takes time; how fine the features must be is a matter of the object.
  const double area = is_object && !is_live ? std::min(object_px * object_px, whole) : whole;
  const int coarsest = is_live ? kCoarsestOctave : 0;
  int octave = is_object ? kFinestOctave : 0;
  while (octave < coarsest && area * std::exp2(-2.0 * octave) > kMostSearchedPixels) ++octave;
  return octave;
}

float usual_sigma(int octave) { return octave < 0 ? 1.6f : octave == 0 ? 1.2f : 1.0f; }

}  // namespace

SiftScale choose_sift_scale(const SiftOptions& options, const cv::Size& image, double object_px,
                            SearchPace pace) {
  SiftScale scale;
  scale.first_octave = options.first_octave ? *options.first_octave : choose_octave(image, object_px, pace);
  scale.sigma = options.sigma ? *options.sigma : usual_sigma(scale.first_octave);
  return scale;
}

int choose_sift_threads(const SiftOptions& options, const SiftScale& scale, const cv::Size& image,
                        SearchPace pace, int cores) {
  if (options.num_threads > 0) return options.num_threads;
  if (pace == SearchPace::kRecording) return 1;
  const double searched = searched_pixels(image, scale.first_octave);
  const int wanted = static_cast<int>(std::ceil(searched / kPixelsOfAThread));
  return std::clamp(wanted, 1, std::max(cores, 1));
}

double feature_pixel_size(const SiftScale& scale) { return std::exp2(std::max(scale.first_octave, 0)); }

}  // namespace mono_pose_tracker
