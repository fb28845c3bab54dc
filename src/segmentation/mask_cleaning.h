#pragma once

#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// Makes a solid object of a raw foreground (CV_8UC1, not 0 = foreground): specks go by opening, gaps close,
/// holes are filled, the largest components stay: `objects` at most, none below min_area_px. Radii in px of
/// the mask.
cv::Mat clean_mask(const cv::Mat& raw, int opening_radius, int closing_radius, int objects,
                   double min_area_px);

/// Fills what the foreground surrounds.
void fill_holes(cv::Mat* mask);

/// How coarse a feature may be at each pixel (CV_8UC1): 0 none, 255 any, else its scale in px times
/// scale_steps at most. A feature keeps margin_px + margin_scales * scale from where the mask is 0; the
/// image's border is no edge.
cv::Mat clearance_of(const cv::Mat& mask, double margin_px, double margin_scales, int scale_steps);

}  // namespace mono_pose_tracker
