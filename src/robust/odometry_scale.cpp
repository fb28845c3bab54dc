#include "robust/odometry_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

// Long beside the millimetres that an encoder's ticks are apart, short enough for ten of them in a metre and
// a half.
constexpr double kSegmentMetres = 0.15;
// The spread of fewer says too little of itself.
constexpr std::size_t kMinSegments = 10;
// Number of segments kept: six metres. The scale may have drifted since older ones.
constexpr std::size_t kMaxSegments = 40;
// Largest angle between the two directions of one motion; beyond it the segment is an outlier.
const double kMinCosine = std::cos(20 * kDegree);
// A camera that hardly moves in the map while odometry advances is not carried by the robot, whatever the
// unit.
constexpr double kMinUnits = 1e-6;
constexpr double kMaxSigma = 0.01, kMaxOff = 0.03;
// Of the logarithm of lengths: followed wrongly, it does no more harm than a first estimate's own error.
constexpr double kMaxFollowed = kMaxSigma;

}  // namespace

void OdometryScale::restart() {
  begin_.reset();
  segments_.clear();
}

bool OdometryScale::follow(double length_scale) {
  const double change = std::log(length_scale);
  if (!(std::abs(change) <= kMaxFollowed)) {
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
  if (metres.norm() < kSegmentMetres) return;
  const Eigen::Vector3d units = (begin_->map_from_camera.inverse() * map_from_camera).translation;
  Segment segment;
  if (units.norm() > kMinUnits) {
    segment.agrees = metres.dot(units) > kMinCosine * metres.norm() * units.norm();
    segment.log_ratio = std::log(metres.norm() / units.norm());
  }
  segments_.push_back(segment);
  if (segments_.size() > kMaxSegments) segments_.pop_front();
  begin_ = {odom_from_camera, map_from_camera};
}

std::optional<OdometryScale::Estimate> OdometryScale::estimate() const {
  std::vector<double> ratios;
  for (const Segment& segment : segments_) {
    if (segment.agrees) ratios.push_back(segment.log_ratio);
  }
  if (ratios.size() < kMinSegments || 2 * ratios.size() < segments_.size()) return std::nullopt;
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
  if (!found || found->sigma > kMaxSigma) return std::nullopt;
  if (is_metric && std::abs(found->metres_per_unit - 1) <= kMaxOff) return std::nullopt;
  return found->metres_per_unit;
}

}  // namespace mono_pose_tracker
