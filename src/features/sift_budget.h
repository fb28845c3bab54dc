#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

/// By decreasing response; a total order, so that results do not depend on the order of detection.
bool is_stronger(const Feature& a, const Feature& b);

/// Selects the features to keep: the strongest, distributed over the image. The k-th strongest feature of a
/// grid cell counts with response / (1 + k / q)^2, where q is the cell's even share of the budget. Textured
/// cells get more than their share, but not at the cost of all others.
class FeatureBudget {
 public:
  /// Indices of the chosen features, ordered by falling response, of equal ones the first. budget 0: all.
  /// Valid until the next call.
  const std::vector<int>& choose(const std::vector<Feature>& features, const cv::Size& image, int budget);

 private:
  void score_by_cell(const std::vector<Feature>& features, const cv::Size& image, int budget);

  std::vector<int> order_;
  std::vector<float> score_;
  std::vector<int> cell_count_;
};

/// Throws std::invalid_argument when gray is not CV_8UC1, or mask is neither empty nor CV_8UC1 of the same
/// size.
void check_images(const cv::Mat& gray, const cv::Mat& mask);

/// True where the mask forbids the feature; a pixel beyond the border asks the border. An empty mask hides
/// nothing.
bool is_masked_out(const cv::Mat& mask, const Feature& feature);

}  // namespace mono_pose_tracker
