#include "sift_budget.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace mono_pose_tracker {
namespace {

// Cells along the longer side: small enough to see where an image is bare, large enough to hold a dozen
// features of a budget of 1,000 to 2,000.
constexpr int kCellsAlongLongerSide = 12;

}  // namespace

bool is_stronger(const Feature& a, const Feature& b) {
  return std::make_tuple(-a.response, a.pixel.y(), a.pixel.x(), a.scale, a.angle) <
         std::make_tuple(-b.response, b.pixel.y(), b.pixel.x(), b.scale, b.angle);
}

const std::vector<int>& FeatureBudget::choose(const std::vector<Feature>& features, const cv::Size& image,
                                              int budget) {
  const auto by_response = [&](int a, int b) { return is_stronger(features[a], features[b]); };
  order_.resize(features.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), by_response);
  const auto is_same = [&](int a, int b) { return !by_response(a, b); };  // of neighbours in that order
  order_.erase(std::unique(order_.begin(), order_.end(), is_same), order_.end());
  if (budget <= 0 || static_cast<int>(order_.size()) <= budget) return order_;

  score_by_cell(features, image, budget);
  const auto by_score = [&](int a, int b) {
    return score_[a] != score_[b] ? score_[a] > score_[b] : by_response(a, b);
  };
  std::nth_element(order_.begin(), order_.begin() + budget, order_.end(), by_score);
  order_.resize(budget);
  std::sort(order_.begin(), order_.end(), by_response);
  return order_;
}

void FeatureBudget::score_by_cell(const std::vector<Feature>& features, const cv::Size& image, int budget) {
  const float cell_size = static_cast<float>(std::max(image.width, image.height)) / kCellsAlongLongerSide;
  const int columns = static_cast<int>(std::ceil(image.width / cell_size));
  const int rows = static_cast<int>(std::ceil(image.height / cell_size));
  const float share = static_cast<float>(budget) / static_cast<float>(columns * rows);
  cell_count_.assign(static_cast<std::size_t>(columns) * rows, 0);
  score_.resize(features.size());
  for (const int i : order_) {
    const int column = std::clamp(static_cast<int>(features[i].pixel.x() / cell_size), 0, columns - 1);
    const int row = std::clamp(static_cast<int>(features[i].pixel.y() / cell_size), 0, rows - 1);
    const int stronger_in_cell = cell_count_[row * columns + column]++;
    const float crowding = 1.0f + static_cast<float>(stronger_in_cell) / share;
    score_[i] = features[i].response / (crowding * crowding);
  }
}

void check_images(const cv::Mat& gray, const cv::Mat& mask) {
  if (!gray.empty() && gray.type() != CV_8UC1) throw std::invalid_argument("gray is not CV_8UC1");
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != gray.size())) {
    throw std::invalid_argument("mask is not CV_8UC1 of the image's size");
  }
}

bool is_masked_out(const cv::Mat& mask, const Feature& feature) {
  if (mask.empty()) return false;
  const int x = std::clamp(cvRound(feature.pixel.x()), 0, mask.cols - 1);
  const int y = std::clamp(cvRound(feature.pixel.y()), 0, mask.rows - 1);
  const std::uint8_t room = mask.at<std::uint8_t>(y, x);
  return room == 0 || (room < 255 && feature.scale * kMaskScaleSteps > room);
}

}  // namespace mono_pose_tracker
