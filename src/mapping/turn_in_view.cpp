#include "turn_in_view.h"

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/geometry/nearest_rotation.h"

namespace mono_pose_tracker {

double turn_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                    const std::vector<Eigen::Vector3d>& bearings2) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < bearings1.size(); ++i) sum += bearings2[i] * bearings1[i].transpose();
  const Eigen::Matrix3d rotation = nearest_rotation(sum);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& b : bearings1) middle += b;
  middle.normalize();
  std::vector<double> left_over, away;
  for (std::size_t i = 0; i < bearings1.size(); ++i) {
    left_over.push_back((rotation * bearings1[i] - bearings2[i]).norm());
    away.push_back((bearings1[i] - middle).norm());
  }
  return median(std::move(left_over)) / std::max(median(std::move(away)), 1e-6);
}

}  // namespace mono_pose_tracker
