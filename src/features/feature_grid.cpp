#include "mono_pose_tracker/features/feature_grid.h"

namespace mono_pose_tracker {

FeatureGrid::FeatureGrid(const FeatureSet& features, int width, int height, int cell_px)
    : cell_px_(cell_px),
      cells_x_((width + cell_px - 1) / cell_px),
      cells_y_((height + cell_px - 1) / cell_px) {
  const int n = features.size();
  std::vector<int> cell_of(n);
  begin_.assign(cells_x_ * cells_y_ + 1, 0);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2f& p = features.features[i].pixel;
    cell_of[i] = cell(p.y(), cells_y_) * cells_x_ + cell(p.x(), cells_x_);
    ++begin_[cell_of[i] + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  index_.resize(n);
  pixels_.resize(n);
  for (int i = 0; i < n; ++i) {
    const int k = next[cell_of[i]]++;
    index_[k] = i;
    pixels_[k] = features.features[i].pixel;
  }
}

}  // namespace mono_pose_tracker
