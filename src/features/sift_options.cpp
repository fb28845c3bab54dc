#include <cmath>
#include <opencv2/core/version.hpp>
#include <sstream>
#include <stdexcept>

#include "mono_pose_tracker/features/sift.h"
#include "sift_opencv.h"
#include "sift_own.h"

namespace mono_pose_tracker {
namespace {

template <typename T>
void check_range(const char* key, T value, T low, T high) {
  if (value >= low && value <= high) return;  // false for NaN as well
  std::ostringstream text;
  text << key << " is " << value << ", expected " << low << " to " << high;
  throw std::invalid_argument(text.str());
}

}  // namespace

void SiftOptions::validate() const {
  if (implementation != "own" && implementation != "opencv") {
    throw std::invalid_argument("implementation is '" + implementation + "', expected own or opencv");
  }
  if (implementation == "opencv" && !has_opencv_sift()) {
    throw std::invalid_argument("implementation is 'opencv', expected own: this build uses OpenCV " CV_VERSION
                                ", which has no SIFT; OpenCV 4.4 or newer has it");
  }
  if (first_octave) check_range("first_octave", *first_octave, kFinestOctave, kCoarsestOctave);
  check_range("reduction", reduction, 1, 1000);
  check_range("max_features", max_features, 0, kMostFeatures);
  check_range("contrast_threshold", contrast_threshold, 0.0f, 1.0f);
  check_range("edge_threshold", edge_threshold, 1.0f, 1000.0f);
  check_range("octave_layers", octave_layers, 1, 10);
  if (sigma) check_range("sigma", *sigma, 0.6f, 10.0f);
  check_range("min_features", min_features, 0, kMostFeatures);
  check_range("num_threads", num_threads, 0, 64);
}

std::unique_ptr<FeatureExtractor> make_sift_extractor(const SiftOptions& options) {
  options.validate();
  return options.implementation == "opencv" ? make_opencv_sift(options) : make_own_sift(options);
}

}  // namespace mono_pose_tracker
