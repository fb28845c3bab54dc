#include "five_point_motion.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mono_pose_tracker {
namespace {

/// The rotation that takes the frame of two bearings to that of two others.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Matrix3d frame;
  frame.col(0) = (a + b).normalized();
  frame.col(1) = (a - b).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

AlignedPairs align(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2) {
  int furthest = 1;
  for (int i = 2; i < 5; ++i) {
    if (x1[0].dot(x1[i]) < x1[0].dot(x1[furthest])) furthest = i;
  }
  AlignedPairs pairs;
  pairs.turn = frame_of(x2[0], x2[furthest]) * frame_of(x1[0], x1[furthest]).transpose();
  double sum = 0;
  for (int i = 0; i < 5; ++i) {
    pairs.x1[i] = pairs.turn * x1[i];
    pairs.x2[i] = x2[i];
    sum += pairs.x1[i].cross(x2[i]).squaredNorm();
  }
  // A smaller sine is all rounding.
  pairs.parallax = std::max(std::sqrt(sum / 5), 1e-9);
  return pairs;
}

double rough_motion(const Eigen::Matrix3d& essential, Motion* motion) {
  const Eigen::Matrix3d e = essential * std::sqrt(2 / essential.squaredNorm());
  Eigen::Matrix3d cofactor;
  cofactor << e.col(1).cross(e.col(2)), e.col(2).cross(e.col(0)), e.col(0).cross(e.col(1));
  int longest;
  const double length2 = cofactor.colwise().squaredNorm().maxCoeff(&longest);
  if (!(length2 > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d t = cofactor.col(longest) / std::sqrt(length2);
  Eigen::Matrix3d& r = motion->rotation;
  for (int i = 0; i < 3; ++i) r.col(i) = cofactor.col(i) - t.cross(e.col(i));
  motion->translation = t;
  const double lengths2 = r.squaredNorm() - 3;
  return std::abs(lengths2) + std::abs(r.col(0).dot(r.col(1))) + std::abs(r.col(0).dot(r.col(2))) +
         std::abs(r.col(1).dot(r.col(2)));
}

// With a = t . R x1, b = t . x2 and c = R x1 . x2 the distances along both rays, times sin^2 of the angle
// between them, are b c - a and b - a c. Half a turn makes 2 a b - c of c, -t changes both signs.
Fronts fronts_of(const Motion& motion, const AlignedPairs& pairs, double tolerance) {
  Fronts fronts;
  for (int i = 0; i < 5 && fronts.any(); ++i) {
    const Eigen::Vector3d turned = motion.rotation * pairs.x1[i];
    const double a = motion.translation.dot(turned), b = motion.translation.dot(pairs.x2[i]);
    const double c = turned.dot(pairs.x2[i]);
    const double slack2 = tolerance * tolerance * (1 - b * b);
    const auto check = [slack2](double first, double second, bool* in_front, bool* behind) {
      const bool first_is_small = first * first < slack2, second_is_small = second * second < slack2;
      *in_front &= ((first > 0) | first_is_small) & ((second > 0) | second_is_small);
      *behind &= ((first < 0) | first_is_small) & ((second < 0) | second_is_small);
    };
    check(b * c - a, b - a * c, &fronts.as_is, &fronts.reversed);
    const double twisted_c = 2 * a * b - c;
    check(b * twisted_c - a, b - a * twisted_c, &fronts.twisted, &fronts.twisted_reversed);
  }
  return fronts;
}

double polish(const AlignedPairs& pairs, Motion* motion) {
  Eigen::Matrix3d& rotation = motion->rotation;
  Eigen::Vector3d& t = motion->translation;
  double first_step = 0;
  for (int iteration = 0; iteration < 20; ++iteration) {
    std::array<Eigen::Vector3d, 5> turned1, normals;
    Eigen::Matrix<double, 5, 1> residual;
    for (int i = 0; i < 5; ++i) {
      turned1[i] = rotation * pairs.x1[i];
      normals[i] = turned1[i].cross(pairs.x2[i]);
      residual[i] = normals[i].dot(t);
    }
    // Five residuals of this length need no polish: at a double root the motion is within 1e-7 of it.
    if (residual.squaredNorm() < 1e-14 * 1e-14) return first_step;
    const Eigen::Vector3d u = t.unitOrthogonal(), v = t.cross(u);
    Eigen::Matrix<double, 5, 5> jacobian;
    for (int i = 0; i < 5; ++i) {
      jacobian.row(i) << turned1[i].cross(pairs.x2[i].cross(t)).transpose(), normals[i].dot(u),
          normals[i].dot(v);
    }
    const Eigen::Matrix<double, 5, 1> step = jacobian.partialPivLu().solve(-residual);
    const double length = step.norm();
    if (iteration == 0) first_step = length;
    // A step of a tenth of a radian is none of a polish.
    if (!(length < 0.1)) break;
    const Eigen::Quaterniond turn(1, step[0] / 2, step[1] / 2, step[2] / 2);
    rotation = turn.normalized().toRotationMatrix() * rotation;
    t = (t + step[3] * u + step[4] * v).normalized();
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace mono_pose_tracker
