#include "mono_pose_tracker/mapping/pose_support.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

constexpr int kColumns = 8, kRows = 6;
constexpr double kMinFound = 0.2;    // of the expected
constexpr int kFewFeatures = 150;    // an image that has fewer shows too little to lack what is not found
constexpr double kMinSpread = 0.25;  // a quarter of where there is anything to see
constexpr double kCorner = 0.125;

int cell_of(const ImageFeatures& image, int feature, int width, int height) {
  const Eigen::Vector2f& pixel = image.set.features[feature].pixel;
  const int column = std::clamp(static_cast<int>(kColumns * pixel.x() / width), 0, kColumns - 1);
  const int row = std::clamp(static_cast<int>(kRows * pixel.y() / height), 0, kRows - 1);
  return row * kColumns + column;
}

}  // namespace

PoseSupport pose_support(const ImageFeatures& image, int width, int height, const std::vector<int>& inliers,
                         double expected) {
  std::vector<char> any(kColumns * kRows), held(kColumns * kRows);
  for (int f = 0; f < image.size(); ++f) any[cell_of(image, f, width, height)] = 1;
  for (const int f : inliers) held[cell_of(image, f, width, height)] = 1;
  PoseSupport support;
  support.found = static_cast<int>(inliers.size());
  support.features = image.size();
  support.expected = expected;
  const auto cells = std::count(any.begin(), any.end(), 1);
  if (cells > 0) support.spread = static_cast<double>(std::count(held.begin(), held.end(), 1)) / cells;
  return support;
}

bool is_supported(const PoseSupport& support, int min_inliers) {
  const double expected =
      std::min(support.expected, static_cast<double>(std::max(support.features, kFewFeatures)));
  return support.found >= min_inliers && support.expected >= min_inliers &&
         support.found >= kMinFound * expected && support.spread >= kMinSpread;
}

bool hangs_in_corner(const PoseSupport& support) { return support.spread < kCorner; }

}  // namespace mono_pose_tracker
