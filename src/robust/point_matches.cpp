#include "robust/point_matches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/rotation.h"
#include "common/toolchain.h"
#include "levenberg_marquardt.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "robust/early_rejection.h"
#include "robust/noise_threshold.h"
#include "shuffled_indices.h"

namespace mono_pose_tracker {

namespace {

// sin^2 of the angle between bearings and the directions to points p in the camera's frame; 1 behind the
// camera.
Packet squared_angles(const PacketVector& p, const PacketVector& bearings) {
  const PacketVector across = cross(p, bearings);
  return (dot(p, bearings) > 0).select(dot(across, across) / dot(p, p), Packet::Ones());
}

// Coordinates of a block's matches, one axis after the other.
struct Block {
  const double *point[3], *bearing[3];
};

// One bit per packet of the block: set if the packet may hold a match within the threshold. Most matches are
// outliers of most models. They are rejected without division and without the cross product, whose norm is
// sqrt(|p|^2 - (p . b)^2). The margin of 1e-12 exceeds the rounding error of any order of the sums for points
// less than 1000 times as far from the map's origin as from the camera, so the result does not depend on the
// processor. m: camera_from_map, row by row.
MPT_FUNCTION_CLONES unsigned packets_with_inliers(const Block& block, const double (&m)[12],
                                                  double squared_threshold) {
  const double least_squared_cosine = 1 - squared_threshold - 1e-12;
  const double *x = block.point[0], *y = block.point[1], *z = block.point[2];
  const double *bx = block.bearing[0], *by = block.bearing[1], *bz = block.bearing[2];
  double excess[kBlockSize];
  for (int i = 0; i < kBlockSize; ++i) {
    const double px = m[0] * x[i] + m[1] * y[i] + m[2] * z[i] + m[3];
    const double py = m[4] * x[i] + m[5] * y[i] + m[6] * z[i] + m[7];
    const double pz = m[8] * x[i] + m[9] * y[i] + m[10] * z[i] + m[11];
    const double along = px * bx[i] + py * by[i] + pz * bz[i];
    // along * |along| is negative behind the camera.
    excess[i] = along * std::abs(along) - least_squared_cosine * (px * px + py * py + pz * pz);
  }
  unsigned packets = 0;
  for (int k = 0; k < kBlockSize / kPacketSize; ++k) {
    unsigned any = 0;
    for (int i = kPacketSize * k; i < kPacketSize * (k + 1); ++i)
      any |= static_cast<unsigned>(excess[i] >= 0);
    packets |= any << k;
  }
  return packets;
}

Block block_of(const PointMatches& matches, int begin) {
  Block block;
  for (int axis = 0; axis < 3; ++axis) {
    block.point[axis] = matches.points().from(axis, begin);
    block.bearing[axis] = matches.bearings().from(axis, begin);
  }
  return block;
}

using Equations = NormalEquations<6>;

// Sums over matches of w (I - u u^T), by its six different elements.
struct ProjectorSum {
  Packet xx = Packet::Zero(), yy = Packet::Zero(), zz = Packet::Zero();
  Packet xy = Packet::Zero(), xz = Packet::Zero(), yz = Packet::Zero();

  void add(const Packet& w, const PacketVector& u) {
    const PacketVector wu = w * u;
    xx += w - wu.x * u.x;
    yy += w - wu.y * u.y;
    zz += w - wu.z * u.z;
    xy -= wu.x * u.y;
    xz -= wu.x * u.z;
    yz -= wu.y * u.z;
  }

  Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m;
    m << xx.sum(), xy.sum(), xz.sum(), xy.sum(), yy.sum(), yz.sum(), xz.sum(), yz.sum(), zz.sum();
    return m;
  }
};

// Residual u - b for the direction u to the point, nearly the angle between them; the perturbation is x' =
// exp(w) x + v in the camera's frame, order v, w. With J of u, J^T J has the blocks (I - u u^T) / |p|^2,
// -[u]x / |p|, I - u u^T.
Equations linearize(const PointMatches& matches, const CameraPose& pose, double squared_threshold) {
  ProjectorSum by_shift, by_turn;
  const Packet zero = Packet::Zero();
  PacketVector mixed{zero, zero, zero}, shift_gradient{zero, zero, zero}, turn_gradient{zero, zero, zero};
  for (int i = 0; i < matches.size(); i += kPacketSize) {
    const PacketVector p = pose.rotation * matches.points().packet(i) + pose.translation;
    const PacketVector b = matches.bearings().packet(i);
    const Packet weight = (squared_angles(p, b) < squared_threshold).select(Packet::Ones(), zero);
    const Packet inverse = 1 / dot(p, p).max(1e-300).sqrt();  // not 0 / 0 at the camera's centre
    const PacketVector u = inverse * p;
    const Packet weight_inverse = weight * inverse;
    const Packet weight_inverse_squared = weight_inverse * inverse;
    by_shift.add(weight_inverse_squared, u);
    by_turn.add(weight, u);
    mixed += weight_inverse * u;
    const Packet along = weight_inverse * dot(u, b);
    shift_gradient += along * u;
    shift_gradient -= weight_inverse * b;
    turn_gradient -= weight * cross(u, b);
  }
  const Eigen::Vector3d m = sum(mixed);
  Equations equations;
  equations.information.topLeftCorner<3, 3>() = by_shift.matrix();
  equations.information.bottomRightCorner<3, 3>() = by_turn.matrix();
  equations.information.bottomLeftCorner<3, 3>() = cross_matrix(m);
  equations.information.topRightCorner<3, 3>() = equations.information.bottomLeftCorner<3, 3>().transpose();
  equations.gradient << sum(shift_gradient), sum(turn_gradient);
  return equations;
}

struct CameraPoseProblem {
  const PointMatches& matches;
  double threshold;

  double cost(const CameraPose& pose) const {
    return score_camera_pose(matches, pose, threshold, std::numeric_limits<double>::infinity()).cost;
  }
  Equations linearize(const CameraPose& pose) const {
    return mono_pose_tracker::linearize(matches, pose, threshold * threshold);
  }
  CameraPose stepped(const CameraPose& pose, const Eigen::Matrix<double, 6, 1>& step) const {
    const Eigen::Matrix3d turn = exp_so3_matrix(step.tail<3>());
    return {turn * pose.rotation, turn * pose.translation + step.head<3>()};
  }
};

}  // namespace

PointMatches::PointMatches(const std::vector<Eigen::Vector3d>& bearings_in_camera,
                           const std::vector<Eigen::Vector3d>& points_in_map, std::uint64_t seed)
    : source_(shuffled_indices(points_in_map.size(), seed, [&](std::size_t i) {
        const double norm = bearings_in_camera[i].norm();
        return points_in_map[i].allFinite() && std::isfinite(norm) && norm > 0;
      })) {
  std::vector<Eigen::Vector3d> bearings, points;
  bearings.reserve(source_.size());
  points.reserve(source_.size());
  for (const int i : source_) {
    bearings.push_back(bearings_in_camera[i].normalized());
    points.push_back(points_in_map[i]);
  }
  bearings_ = VectorArray(bearings);
  points_ = VectorArray(points);
}

RansacScore score_camera_pose(const PointMatches& matches, const CameraPose& pose, double threshold,
                              double cost_bound, std::vector<char>* inliers, double log_odds) {
  const double squared_threshold = threshold * threshold;
  const double mean_bound = cost_bound / (squared_threshold * matches.size());
  if (inliers != nullptr) {
    inliers->assign(matches.size(), 0);
  }
  double rows[12];
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(rows) << pose.rotation, pose.translation;
  RansacScore score;
  score.cost = 0;
  double inlier_squares = 0;
  for (int begin = 0; begin < matches.size(); begin += kBlockSize) {
    const int end = std::min(begin + kBlockSize, matches.size());
    const unsigned packets = packets_with_inliers(block_of(matches, begin), rows, squared_threshold);
    for (int i = begin; i < end; i += kPacketSize) {
      if (((packets >> ((i - begin) / kPacketSize)) & 1U) == 0) continue;
      const PacketVector p = pose.rotation * matches.points().packet(i) + pose.translation;
      const Packet squared = squared_angles(p, matches.bearings().packet(i));
      for (int k = 0; k < std::min(kPacketSize, end - i); ++k) {
        if (!(squared[k] < squared_threshold)) continue;
        inlier_squares += squared[k];
        ++score.num_inliers;
        if (inliers != nullptr) (*inliers)[i + k] = 1;
      }
    }
    const double cost = inlier_squares + (end - score.num_inliers) * squared_threshold;
    if (cost >= cost_bound || is_hopeless(cost / (squared_threshold * end), end, mean_bound, log_odds)) {
      return RansacScore();
    }
    score.cost = cost;
  }
  return score;
}

void refine_camera_pose(const PointMatches& matches, double threshold, int max_iterations, CameraPose* pose) {
  levenberg_marquardt(CameraPoseProblem{matches, threshold}, {max_iterations, 1e-9, 0}, pose);
}

void widen_camera_pose(const PointMatches& matches, double threshold, double widening, int max_iterations,
                       CameraPose* pose) {
  CameraPose candidate = *pose;
  refine_camera_pose(matches, widening * threshold, max_iterations, &candidate);
  refine_camera_pose(matches, threshold, max_iterations, &candidate);
  const auto cost = [&](const CameraPose& of) { return CameraPoseProblem{matches, threshold}.cost(of); };
  if (cost(candidate) < cost(*pose)) *pose = candidate;
}

void polish_camera_pose(const PointMatches& matches, double threshold, int max_iterations, CameraPose* pose) {
  const RansacScore score =
      score_camera_pose(matches, *pose, threshold, std::numeric_limits<double>::infinity());
  const double wide = noise_threshold(score, matches.size(), threshold, 2, 6);
  const int num_data =
      score_camera_pose(matches, *pose, wide, std::numeric_limits<double>::infinity()).num_inliers;
  if (!noise_explains(num_data - score.num_inliers, num_data, threshold, wide)) return;
  refine_camera_pose(matches, wide, max_iterations, pose);
}

}  // namespace mono_pose_tracker
