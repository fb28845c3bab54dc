#include "ego_vehicle_features.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "mapping/independent_motion.h"
#include "match_shift.h"
#include "static_overlay.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMinFixed = 3;  // features of a pair: one or two are fixed by chance
constexpr double kMinPairs = 0.5;  // share of all pairs: motion masks may have excluded them from the others
constexpr int kCells = 8;          // along each image axis

// Whether the feature kept its pixel although the camera's motion excludes that.
bool is_fixed(const RegisteredImage& first, const RegisteredImage& second, const Match& m,
              ObeyedMotion motion) {
  if (motion == ObeyedMotion::kObject || motion == ObeyedMotion::kBoth) return false;
  return shift_px(*first.image, *second.image, m) < kSamePlacePx;
}

std::vector<char> fixed_in(const RegisteredImage& first, const RegisteredImage& second,
                           const PairMotions& pair) {
  std::vector<char> fixed;
  for (std::size_t i = 0; i < pair.matches.size(); ++i)
    fixed.push_back(is_fixed(first, second, pair.matches[i], pair.obeyed[i]));
  return fixed;
}

// Image cells with features, and those in which most features are fixed.
struct Cells {
  int seen = 0, fixed = 0;
};

Cells count_cells(const RegisteredImage& image, const std::vector<Match>& matches,
                  const std::vector<char>& fixed) {
  const CameraModel& camera = image.image->camera;
  std::array<std::array<int, 2>, kCells * kCells> counts{};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector2f& pixel = image.image->set.features[matches[i].first].pixel;
    const int column = std::clamp(static_cast<int>(kCells * pixel.x()) / camera.width(), 0, kCells - 1);
    const int row = std::clamp(static_cast<int>(kCells * pixel.y()) / camera.height(), 0, kCells - 1);
    ++counts[row * kCells + column][fixed[i] != 0];
  }
  Cells cells;
  for (const auto& [moving, still] : counts) {
    cells.seen += moving + still > 0;
    cells.fixed += still > moving;
  }
  return cells;
}

}  // namespace

void exclude_ego_vehicle_features(const std::vector<RegisteredImage>& images,
                                  const std::vector<std::pair<int, int>>& pairs, const RansacOptions& ransac,
                                  std::vector<PairMotions>* motions) {
  std::vector<std::vector<char>> fixed;
  std::size_t pairs_with = 0;
  Cells all;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const RegisteredImage &first = images[pairs[i].first], &second = images[pairs[i].second];
    fixed.push_back(fixed_in(first, second, (*motions)[i]));
    pairs_with += static_cast<std::size_t>(std::count(fixed[i].begin(), fixed[i].end(), 1)) >= kMinFixed;
    const Cells cells = count_cells(first, (*motions)[i].matches, fixed[i]);
    all.seen += cells.seen;
    all.fixed += cells.fixed;
  }
  if (static_cast<double>(pairs_with) < kMinPairs * static_cast<double>(pairs.size())) return;
  if (all.fixed > IndependentMotion::kComparable * all.seen) return;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::vector<Match> rest;
    for (std::size_t m = 0; m < fixed[i].size(); ++m) {
      if (!fixed[i][m]) rest.push_back((*motions)[i].matches[m]);
    }
    if (rest.size() == fixed[i].size()) continue;
    (*motions)[i] = motions_of(std::move(rest), images[pairs[i].first], images[pairs[i].second], ransac);
  }
}

}  // namespace mono_pose_tracker
