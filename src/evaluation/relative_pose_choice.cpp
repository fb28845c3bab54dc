#include "evaluation/relative_pose_choice.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <utility>

#include "common/rotation.h"
#include "geometry/essential.h"

namespace mono_pose_tracker {
namespace {

double squared_sampson_errors(const Eigen::Matrix3d& essential, const ChoiceInput& input) {
  double sum = 0;
  for (std::size_t i = 0; i < input.bearings1.size(); ++i) {
    const double error = sampson_error(essential, input.bearings1[i], input.bearings2[i]);
    sum += error * error;
  }
  return sum;
}

/// Number of the first `count` points in front of both cameras.
int count_in_front(const Rigid3& pose, const ChoiceInput& input, std::size_t count) {
  int in_front = 0;
  for (std::size_t i = 0; i < count; ++i)
    in_front += is_in_front(pose, input.bearings1[i], input.bearings2[i]);
  return in_front;
}

/// Cost of a pose by the rule of choice, compared lexicographically.
std::pair<double, double> badness(const Rigid3& pose, double sampson, const ChoiceInput& input,
                                  Choice choice) {
  if (choice == Choice::kTruth) {
    const PoseError error = pose_error(pose, input.true_second_from_first);
    return {error.rotation_deg + error.translation_deg, 0};
  }
  if (choice == Choice::kCheirality) return {-count_in_front(pose, input, input.sample_size), sampson};
  // The four poses of a matrix share its error, to the last bit.
  return {sampson, -count_in_front(pose, input, input.bearings1.size())};
}

}  // namespace

PoseError pose_error(const Rigid3& estimate, const Rigid3& truth) {
  return {rotation_angle_between(estimate.rotation, truth.rotation) / kDegree,
          angle_between(estimate.translation, truth.translation) / kDegree};
}

Eigen::Matrix3d nearest_essential(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double s = std::sqrt(0.5);
  return svd.matrixU() * Eigen::Vector3d(s, s, 0).asDiagonal() * svd.matrixV().transpose();
}

bool choose_pose(const std::vector<Eigen::Matrix3d>& essentials, const ChoiceInput& input, Choice choice,
                 Rigid3* second_from_first) {
  bool found = false;
  std::pair<double, double> least;
  for (const Eigen::Matrix3d& essential : essentials) {
    std::array<Rigid3, 4> poses;
    if (!decompose_essential(essential, &poses)) continue;
    const double sampson = squared_sampson_errors(essential, input);
    for (const Rigid3& pose : poses) {
      const std::pair<double, double> bad = badness(pose, sampson, input, choice);
      if (found && !(bad < least)) continue;
      found = true;
      least = bad;
      *second_from_first = pose;
    }
  }
  return found;
}

}  // namespace mono_pose_tracker
