#include "mono_pose_tracker/tracking/tracker_options.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/threads.h"
#include "features/sift_scale_space.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "tracking/load_governor.h"

namespace mono_pose_tracker {

namespace {

// m: shorter than any camera's working distance; the estimators' smallest steps are orders of magnitude
// below.
constexpr double kLeastLength = 1e-6;

// Radians: the precision of a bearing in doubles.
constexpr double kLeastThreshold = 1e-12;

// The map's first two keyframes, and as many near the camera as constrain its pose.
constexpr int kFewestKeyframes = 10;

}  // namespace

RansacOptions TrackerOptions::ransac(double focal_px) const {
  RansacOptions ransac;
  // For any focal length of a calibration: the estimators accept errors up to half a radian.
  ransac.threshold = std::clamp(inlier_threshold_px / focal_px, kLeastThreshold, 0.5);
  ransac.confidence = confidence;
  ransac.max_iterations = max_iterations;
  ransac.min_iterations = std::min(ransac.min_iterations, max_iterations);
  ransac.seed = seed;
  ransac.cancelled = cancelled;
  return ransac;
}

MapperOptions TrackerOptions::mapper(double focal_px) const {
  MapperOptions mapper;
  mapper.mapping = mapping;
  mapper.scale = scale;
  mapper.matching = matching;
  mapper.bundle = bundle;
  mapper.ransac = ransac(focal_px);
  mapper.min_inliers = resection.min_inliers;
  mapper.separates_motions = segmentation.wants_turning_object();
  mapper.tells_background = segmentation.is_automatic();
  mapper.threads = threads;
  return mapper;
}

TrackerOptions TrackerOptions::on_threads(int count) const {
  TrackerOptions options = *this;
  options.threads = count;
  // Its tasks are short: threads without a processor would delay the others.
  options.bundle.own_threads = std::clamp(count, 1, processors());
  // Images are prepared in parallel; more threads within one, or in Ceres, would only wait, or change last
  // digits.
  options.sift.num_threads = options.bundle.num_threads = 1;
  return options;
}

TrackerOptions TrackerOptions::cancellable(CancelFlag flag) const {
  TrackerOptions options = *this;
  options.cancelled = options.sift.cancelled = options.matching.cancelled = flag;
  options.bundle.cancel = [flag] { return is_set(flag); };
  return options;
}

TrackerOptions TrackerOptions::for_images(const cv::Size& image, SearchPace pace, int load_level) const {
  TrackerOptions options = *this;
  if (load_level >= kLessMapped) {
    options.mapping.window_keyframes = std::max(mapping.window_keyframes / 2, 2);
    options.mapping.matching_keyframes = std::max(mapping.matching_keyframes / 2, 1);
  }
  if (load_level >= kFewerFeatures) {
    options.sift.max_features = (sift.max_features + 1) / 2;  // 0 (all) stays
    options.sift.min_features = sift.min_features / 2;
  }
  const bool is_chosen = sift.first_octave.has_value();
  SiftScale chosen_scale = choose_sift_scale(sift, image, pace);
  if (load_level >= kCoarserOctave && !is_chosen) {
    options.sift.first_octave = std::min(chosen_scale.first_octave + 1, kCoarsestOctave);
    options.sift.reduction = chosen_scale.reduction;
    chosen_scale = choose_sift_scale(options.sift, image, pace);
  }
  const bool has_time = pace == SearchPace::kRecording || load_level <= kTimeToSpare;
  const bool may_be_finer = !is_chosen && !sift.sigma && has_time;
  // Live, rotating objects are not outlined: the whole image is searched.
  const bool is_finer = may_be_finer && pace == SearchPace::kLive && segmentation.wants_turning_object();
  if (is_finer) chosen_scale = finer(chosen_scale);
  options.sift.first_octave = chosen_scale.first_octave;
  options.sift.reduction = chosen_scale.reduction;
  options.sift.sigma = chosen_scale.sigma;
  options.sift.num_threads = choose_sift_threads(sift, chosen_scale, image, pace, processors());
  options.sift.finer_for_small_objects = may_be_finer && !is_finer;
  // An explicit octave comes with its thresholds; OpenCV's implementation has no choice of octave.
  if (is_chosen || sift.implementation != "own") return options;
  const double pixel = feature_pixel_size(chosen_scale);
  options.inlier_threshold_px *= pixel;
  options.bootstrap.min_parallax_px *= pixel;
  options.mapping.max_reprojection_px *= pixel;
  options.mapping.feature_pixel_size = pixel;
  return options;
}

void TrackerOptions::validate() const {
  TrackerOptions copy = *this;
  std::string problems;
  for (const OptionEntry& entry : option_table(&copy)) {
    if (is_in_range(entry)) continue;
    problems += "; " + entry.key + " = " + option_text(entry) + ", expected " + expected_value(entry);
  }
  const int scales = (scale.known_baseline > 0) + (scale.initial_median_depth > 0) + (scale.marker_size > 0) +
                     scale.odometry;
  for (const auto& [key, length] : {std::pair<const char*, double>("known_baseline", scale.known_baseline),
                                    {"initial_median_depth", scale.initial_median_depth},
                                    {"marker_size", scale.marker_size}}) {
    if (length > 0 && length < kLeastLength) {
      problems += std::string("; scale/") + key + " is below 1e-06, expected 0 or a length in metres";
    }
  }
  if (mapping.max_keyframes > 0 && mapping.max_keyframes < kFewestKeyframes) {
    problems += "; mapping/max_keyframes = " + std::to_string(mapping.max_keyframes) +
                ", expected 0 (no limit) or at least " + std::to_string(kFewestKeyframes);
  }
  if (scales > 1) {
    problems +=
        "; scale/known_baseline, scale/initial_median_depth, scale/marker_size and scale/odometry: expected "
        "one of them at most";
  }
  if (!problems.empty()) throw std::invalid_argument(problems.substr(2));
}

std::string descriptor_kind(const TrackerOptions& options) {
  return options.sift.root_sift ? "root_sift" : "sift";
}

}  // namespace mono_pose_tracker
