#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

/// By falling response; a total order, so that no result depends on the order in which features were found.
bool is_stronger(const Feature& a, const Feature& b);

/// Chooses which features to keep: the strongest, spread over the image. A cell of a grid asks more of each
/// further feature: the k-th strongest in its cell counts with response / (1 + k / q)^2, q being the cell's
/// even share of the budget. Thus texture gets more than its share, but never at the price of all the rest.
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
