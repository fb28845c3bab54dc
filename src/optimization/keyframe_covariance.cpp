#include "optimization/keyframe_covariance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "fixed_keyframes.h"
#include "most_observed_landmarks.h"
#include "optimization/map_adjustment.h"
#include "positive_definite.h"
#include "reduced_system.h"
#include "reprojection.h"

namespace mono_pose_tracker {
namespace {

using PoseCovariance = Eigen::Matrix<double, 6, 6>;
using Gauge = Eigen::Matrix<double, Eigen::Dynamic, 7>;

// Information on the gauge relative to that on a coordinate. The uncertainty (variance) added by the gauge is
// about 0.1 % of that of the coordinates, and the decomposition loses three of its sixteen digits.
constexpr double kGaugeWeight = 1e3;

// Sigmas: a larger residual is more likely an outlier than noise.
constexpr double kLossWidth = 2;

// Of a pose's (w, v) and of the point.
struct Linearized {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
};

bool linearize(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map, Linearized* result) {
  const BundleObservation o = make_observation(0, 0, *keyframe.image, feature);
  if (!is_usable(o)) return false;
  const Eigen::Vector3d x = keyframe.camera_from_map * x_in_map;
  const Reprojection reprojection(o.bearing, o.pixel_from_bearing / o.sigma_px, x);
  if (!reprojection.in_front) return false;
  result->residual = reprojection.residual;
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d d = reprojection.by_point.row(row).transpose();
    result->by_pose.block<1, 3>(row, 0) = x.cross(d).transpose();
    result->by_pose.block<1, 3>(row, 3) = d.transpose();
  }
  result->by_point = reprojection.by_point * keyframe.camera_from_map.rotation_matrix();
  return true;
}

// What turns, moves and sizes the cameras as a whole: their mean rotation, mean position and extent.
Gauge gauge_of(const Map& map, const std::vector<KeyframeId>& keyframes) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const KeyframeId id : keyframes) {
    middle += map.keyframe(id)->center_in_map() / static_cast<double>(keyframes.size());
  }
  Gauge gauge = Gauge::Zero(6 * static_cast<Eigen::Index>(keyframes.size()), 7);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe& keyframe = *map.keyframe(keyframes[i]);
    const Eigen::Matrix3d R = keyframe.camera_from_map.rotation_matrix();
    const auto row = 6 * static_cast<Eigen::Index>(i);
    gauge.block<3, 3>(row, 0) = R;
    gauge.block<3, 3>(row + 3, 3) = R;
    gauge.block<3, 1>(row + 3, 6) = R * (keyframe.center_in_map() - middle);
  }
  return gauge;
}

// The covariance for noise of variance 1. Each coordinate is scaled by its information: a point near a
// camera's lens has so much information on that camera that everything else would be lost to rounding.
std::optional<Eigen::MatrixXd> inverse_held_by(const Gauge& gauge, const Eigen::MatrixXd& information) {
  if (!(information.diagonal().minCoeff() > 0)) return std::nullopt;
  const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
  Gauge scaled = unit.asDiagonal() * gauge;
  scaled.colwise().normalize();
  Eigen::MatrixXd held = unit.asDiagonal() * information * unit.asDiagonal();
  held += kGaugeWeight * scaled * scaled.transpose();
  const std::optional<Eigen::MatrixXd> inverse = inverse_of_positive(held);
  if (!inverse) return std::nullopt;
  return Eigen::MatrixXd(unit.asDiagonal() * *inverse * unit.asDiagonal());
}

// Rotation first, as the reduced system has it; translation first, as covariances are told.
PoseCovariance translation_first(const PoseCovariance& c) {
  PoseCovariance result;
  result << c.bottomRightCorner<3, 3>(), c.bottomLeftCorner<3, 3>(), c.topRightCorner<3, 3>(),
      c.topLeftCorner<3, 3>();
  return result;
}

}  // namespace

std::optional<JointCovariance> joint_keyframe_covariance(const std::vector<KeyframeId>& keyframes,
                                                         int max_fixed, int max_landmarks, const Map& map) {
  std::vector<KeyframeId> free = keyframes;
  std::sort(free.begin(), free.end());
  const std::vector<LandmarkId> landmarks = most_observed_landmarks(map, free, max_landmarks);
  std::vector<KeyframeId> held = fixed_keyframes(map, landmarks, free, max_fixed);
  if (held.size() < 2) {
    free.insert(free.end(), held.begin(), held.end());
    held.clear();
  }
  std::unordered_map<KeyframeId, int> pose_of;
  for (std::size_t i = 0; i < free.size(); ++i) pose_of[free[i]] = static_cast<int>(i);
  for (const KeyframeId id : held) pose_of[id] = -1;

  ReducedSystem system(static_cast<int>(free.size()), 0, kLossWidth);
  const Eigen::Matrix<double, 2, Eigen::Dynamic> nothing(2, 0);
  Linearized at;
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map.landmark(l);
    for (const Observation& o : landmark.observations) {
      const auto pose = pose_of.find(o.keyframe);
      if (pose == pose_of.end()) continue;
      if (linearize(*map.keyframe(o.keyframe), o.feature, landmark.x_in_map, &at)) {
        system.add(pose->second, at.by_pose, at.by_point, nothing, at.residual);
      }
    }
    system.eliminate_point();
  }
  if (system.variance() <= 0) return std::nullopt;
  const std::optional<Eigen::MatrixXd> inverse =
      held.empty() ? inverse_held_by(gauge_of(map, free), system.information())
                   : inverse_of_positive(system.information());
  if (!inverse) return std::nullopt;
  return JointCovariance{std::move(free), system.variance() * *inverse};
}

std::map<KeyframeId, PoseCovariance> keyframe_covariances(const std::vector<KeyframeId>& keyframes,
                                                          int max_fixed, int max_landmarks, const Map& map) {
  std::map<KeyframeId, PoseCovariance> result;
  const std::optional<JointCovariance> joint =
      joint_keyframe_covariance(keyframes, max_fixed, max_landmarks, map);
  if (!joint) return result;
  for (std::size_t i = 0; i < joint->keyframes.size(); ++i) {
    const auto row = 6 * static_cast<Eigen::Index>(i);
    result[joint->keyframes[i]] = translation_first(joint->covariance.block<6, 6>(row, row));
  }
  return result;
}

}  // namespace mono_pose_tracker
