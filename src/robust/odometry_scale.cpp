#include "robust/odometry_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {

void OdometryScale::restart() {
  begin_.reset();
  segments_.clear();
}

bool OdometryScale::follow(double length_scale) {
  const double change = std::log(length_scale);
  if (!(std::abs(change) <= options_.max_followed)) {
    restart();
    return false;
  }
  interrupt();
  for (Segment& segment : segments_) segment.log_ratio -= change;
  return true;
}

void OdometryScale::add(const Rigid3& odom_from_camera, const Rigid3& map_from_camera) {
  if (!begin_) {
    begin_ = {odom_from_camera, map_from_camera};
    return;
  }
  // Both as the camera saw them when the segment began: where odom and map have their axes drops out.
  const Eigen::Vector3d metres = (begin_->odom_from_camera.inverse() * odom_from_camera).translation;
  if (metres.norm() < options_.segment_metres) return;
  const Eigen::Vector3d units = (begin_->map_from_camera.inverse() * map_from_camera).translation;
  Segment segment;
  if (units.norm() > options_.min_units) {
    segment.agrees = metres.dot(units) > options_.min_cosine * metres.norm() * units.norm();
    segment.log_ratio = std::log(metres.norm() / units.norm());
  }
  segments_.push_back(segment);
  if (segments_.size() > options_.max_segments) segments_.pop_front();
  begin_ = {odom_from_camera, map_from_camera};
}

std::optional<OdometryScale::Estimate> OdometryScale::estimate() const {
  std::vector<double> ratios;
  for (const Segment& segment : segments_) {
    if (segment.agrees) ratios.push_back(segment.log_ratio);
  }
  if (ratios.size() < options_.min_segments || 2 * ratios.size() < segments_.size()) return std::nullopt;
  const double middle = median(ratios);
  std::vector<double> deviations;
  for (const double ratio : ratios) deviations.push_back(std::abs(ratio - middle));
  // 1.4826: from the median deviation to a Gaussian's sigma; 1.2533: of a median, not a mean.
  const double sigma =
      1.2533 * 1.4826 * median(std::move(deviations)) / std::sqrt(static_cast<double>(ratios.size()));
  return Estimate{std::exp(middle), sigma, static_cast<int>(ratios.size())};
}

std::optional<double> OdometryScale::correction(bool is_metric) const {
  const std::optional<Estimate> found = estimate();
  if (!found || found->sigma > options_.max_sigma) return std::nullopt;
  if (is_metric && std::abs(found->metres_per_unit - 1) <= options_.max_off) return std::nullopt;
  return found->metres_per_unit;
}

}  // namespace mono_pose_tracker
