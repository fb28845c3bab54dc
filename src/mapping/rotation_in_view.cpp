#include "rotation_in_view.h"

#include <algorithm>
#include <utility>

#include "common/statistics.h"
#include "geometry/nearest_rotation.h"

namespace mono_pose_tracker {

namespace {

std::vector<double> left_over(const std::vector<Eigen::Vector3d>& bearings1,
                              const std::vector<Eigen::Vector3d>& bearings2,
                              const Eigen::Matrix3d& rotation) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < bearings1.size(); ++i) {
    lengths.push_back((rotation * bearings1[i] - bearings2[i]).norm());
  }
  return lengths;
}

// Residual motion after the rotation that explains most of it.
std::vector<double> left_over_by_rotation(const std::vector<Eigen::Vector3d>& bearings1,
                                          const std::vector<Eigen::Vector3d>& bearings2,
                                          const RotationInViewOptions& options) {
  std::vector<double> lengths(bearings1.size(), 0);
  for (int round = 0; round < options.rounds; ++round) {
    const double farthest = options.far * median(lengths);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < bearings1.size(); ++i) {
      if (lengths[i] <= farthest) sum += bearings2[i] * bearings1[i].transpose();
    }
    lengths = left_over(bearings1, bearings2, nearest_rotation(sum));
  }
  return lengths;
}

}  // namespace

double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2, const RotationInViewOptions& options) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& b : bearings1) middle += b;
  middle.normalize();
  std::vector<double> away;
  for (const Eigen::Vector3d& b : bearings1) away.push_back((b - middle).norm());
  return median(left_over_by_rotation(bearings1, bearings2, options)) /
         std::max(median(std::move(away)), 1e-6);
}

}  // namespace mono_pose_tracker
