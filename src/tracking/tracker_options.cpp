#include "mono_pose_tracker/tracking/tracker_options.h"

#include <stdexcept>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {

RansacOptions TrackerOptions::ransac(double focal_px) const {
  RansacOptions ransac;
  ransac.threshold = inlier_threshold_px / focal_px;
  ransac.confidence = confidence;
  ransac.max_iterations = max_iterations;
  ransac.seed = seed;
  return ransac;
}

MapperOptions TrackerOptions::mapper(double focal_px) const {
  return {mapping, scale, matching, bundle, ransac(focal_px), resection.min_inliers};
}

void TrackerOptions::validate() const {
  TrackerOptions copy = *this;
  std::string problems;
  for (const OptionEntry& entry : option_table(&copy)) {
    if (is_in_range(entry)) continue;
    problems += "; " + entry.key + " = " + option_text(entry) + ", expected " + expected_value(entry);
  }
  const int scales = (scale.known_baseline > 0) + (scale.initial_median_depth > 0) + (scale.marker_size > 0);
  if (scales > 1) {
    problems +=
        "; scale/known_baseline, scale/initial_median_depth and scale/marker_size: expected one of them at "
        "most";
  }
  if (!problems.empty()) throw std::invalid_argument(problems.substr(2));
}

}  // namespace mono_pose_tracker
