#include "mapping/pose_support.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

constexpr PoseSupportOptions kSupport{};

constexpr int kColumns = 8, kRows = 6;

int cell_of(const ImageFeatures& image, int feature, int width, int height) {
  const Eigen::Vector2f& pixel = image.set.features[feature].pixel;
  const int column = std::clamp(static_cast<int>(kColumns * pixel.x() / width), 0, kColumns - 1);
  const int row = std::clamp(static_cast<int>(kRows * pixel.y() / height), 0, kRows - 1);
  return row * kColumns + column;
}

}  // namespace

PoseSupport pose_support(const ImageFeatures& image, int width, int height, const std::vector<int>& inliers,
                         const ExpectedFinds& in_map) {
  std::vector<char> any(kColumns * kRows), held(kColumns * kRows);
  for (int f = 0; f < image.size(); ++f) any[cell_of(image, f, width, height)] = 1;
  for (const int f : inliers) held[cell_of(image, f, width, height)] = 1;
  PoseSupport support;
  support.found = static_cast<int>(inliers.size());
  support.features = image.size();
  support.in_map = in_map;
  const auto cells = std::count(any.begin(), any.end(), 1);
  if (cells > 0) support.spread = static_cast<double>(std::count(held.begin(), held.end(), 1)) / cells;
  return support;
}

bool is_supported(const PoseSupport& support, int min_inliers) {
  const double most = std::max(support.features, kSupport.few_features), expected = support.in_map.expected;
  if (support.found < min_inliers || expected < min_inliers || support.spread < kSupport.min_spread)
    return false;
  const bool is_as_from_near =
      support.found >= kSupport.min_found_from_near * std::min<double>(support.in_map.in_view, most);
  return support.found >= kSupport.min_found * std::min(expected, most) &&
         (is_as_from_near || support.found <= kSupport.max_oblique_excess * expected);
}

bool is_confined_to_corner(const PoseSupport& support) { return support.spread < kSupport.corner; }

}  // namespace mono_pose_tracker
