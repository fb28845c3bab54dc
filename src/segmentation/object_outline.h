#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

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

/// Pixels of the features of an image: on the object, and elsewhere.
struct ObjectPoints {
  std::vector<cv::Point2f> object, other;
};

/// Distance of each pixel from the nearest of the points in the image [px]; without any, larger than all
/// distances.
cv::Mat1f distances_from(const std::vector<cv::Point2f>& points, const cv::Size& size);

/// Distance by which the object extends beyond its outermost points [px], proportional to its size. At least
/// one point.
float reach_of(const std::vector<cv::Point2f>& points);

/// Thresholds of outline_object. Lengths are in px of the reduced image (320 px width), shares in [0, 1].
struct OutlineOptions {
  std::size_t min_points = 20;  // of the object: fewer make no sample of its colours
  float of_feature = 2;         // the texture within this distance of a feature belongs to the object ...
  float apart = 4;              // ... if no other feature is within this distance
  int rounds = 2;               // of the cut: further ones move the outline by a pixel
  double min_held = 0.8;  // share of the object's points that the outline must hold; some landmarks lie at
                          // its rim, where the outline may run
  double min_of_piece = 0.05;  // the same of a single piece (a tag attached to it)
  double sigma = 2;            // grey levels: added noise, as much as any camera has
};

/// The outline of an object from its points and its appearance: GrabCut (Rother, Kolmogorov and Blake,
/// SIGGRAPH 2004; OpenCV's) on the image reduced to a width of 320 px. It starts with the region near the
/// object's points and farther from the others. image: CV_8UC1 or CV_8UC3 (BGR). Returns CV_8UC1 of its size,
/// 255: object. Empty if too few of the points are in the image, or the outline excludes many of them.
cv::Mat outline_object(const cv::Mat& image, const ObjectPoints& points, const OutlineOptions& options = {});

}  // namespace mono_pose_tracker
