#pragma once

#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// Makes a solid object of a raw foreground (CV_8UC1, not 0 = foreground): opening removes specks, closing
/// fills gaps, holes are filled. Keeps at most `objects` components, the largest, each of at least
/// min_area_px. Radii in px of the mask.
cv::Mat clean_mask(const cv::Mat& raw, int opening_radius, int closing_radius, int objects,
                   double min_area_px);

/// Fills the holes of the foreground.
void fill_holes(cv::Mat* mask);

/// Largest allowed scale of a feature at each pixel (CV_8UC1): 0 none, 255 any, else scale in px times
/// scale_steps. A feature keeps margin_px + margin_scales * scale from pixels where the mask is 0; the
/// image's border does not count.
cv::Mat clearance_of(const cv::Mat& mask, double margin_px, double margin_scales, int scale_steps);

}  // namespace mono_pose_tracker
