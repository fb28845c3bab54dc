#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/features/feature_set.h"

namespace mono_pose_tracker {

/// Features of one image sorted by position, for searches around a predicted pixel.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// cell_px: about the radius of the searches.
  FeatureGrid(const FeatureSet& features, int width, int height, int cell_px = 24);

  /// Calls visit(feature index) for every feature within radius_px of the pixel, in a fixed order.
  template <typename Visit>
  void visit_near(const Eigen::Vector2d& pixel, double radius_px, Visit&& visit) const {
    find_near(pixel, radius_px, [&](int feature) {
      visit(feature);
      return false;
    });
  }

  bool has_near(const Eigen::Vector2d& pixel, double radius_px) const {
    return find_near(pixel, radius_px, [](int) { return true; });
  }

 private:
  // Whether is_it(feature index) is true for a feature within radius_px; stops at the first one.
  template <typename IsIt>
  bool find_near(const Eigen::Vector2d& pixel, double radius_px, IsIt&& is_it) const {
    if (cells_x_ == 0) return false;
    const int x0 = cell(pixel.x() - radius_px, cells_x_), x1 = cell(pixel.x() + radius_px, cells_x_);
    const int y0 = cell(pixel.y() - radius_px, cells_y_), y1 = cell(pixel.y() + radius_px, cells_y_);
    const double radius2 = radius_px * radius_px;
    for (int y = y0; y <= y1; ++y) {
      for (int k = begin_[y * cells_x_ + x0]; k < begin_[y * cells_x_ + x1 + 1]; ++k) {
        if ((pixels_[k].cast<double>() - pixel).squaredNorm() <= radius2 && is_it(index_[k])) return true;
      }
    }
    return false;
  }

  int cell(double coordinate, int cells) const {
    const int c = static_cast<int>(coordinate / cell_px_);
    return c < 0 ? 0 : (c >= cells ? cells - 1 : c);
  }

  int cell_px_ = 1, cells_x_ = 0, cells_y_ = 0;
  std::vector<int> begin_;  // of each cell in index_, and one past the end
  std::vector<int> index_;
  std::vector<Eigen::Vector2f> pixels_;
};

}  // namespace mono_pose_tracker
