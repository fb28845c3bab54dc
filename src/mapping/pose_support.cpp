#include "mapping/pose_support.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

constexpr int kColumns = 8, kRows = 6;
constexpr double kMinFound = 0.2;  // of the expected
// From the first share of the landmarks in view on, any viewpoint is possible. Below it, no more than the
// second number times the expectation may be found.
constexpr double kMinFoundFromNear = 0.15, kMaxObliqueExcess = 2;
constexpr int kFewFeatures = 150;    // with fewer, missing landmarks are no evidence
constexpr double kMinSpread = 0.25;  // a quarter of the cells with features
constexpr double kCorner = 0.125;

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
  const double most = std::max(support.features, kFewFeatures), expected = support.in_map.expected;
  if (support.found < min_inliers || expected < min_inliers || support.spread < kMinSpread) return false;
  const bool is_as_from_near =
      support.found >= kMinFoundFromNear * std::min<double>(support.in_map.in_view, most);
  return support.found >= kMinFound * std::min(expected, most) &&
         (is_as_from_near || support.found <= kMaxObliqueExcess * expected);
}

bool is_confined_to_corner(const PoseSupport& support) { return support.spread < kCorner; }

}  // namespace mono_pose_tracker
