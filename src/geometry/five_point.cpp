#include "mono_pose_tracker/geometry/five_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "five_point_constraints.h"
#include "five_point_elimination.h"
#include "five_point_motion.h"
#include "geometry/polynomial_roots.h"
#include "null_space.h"

namespace mono_pose_tracker {
namespace {

// Each mirrors the basis of the null space, whose own axes can miss a solution of a symmetric scene: generic
// vectors.
const Eigen::Vector4d kMirrors[4] = {{0.2887, -0.6471, 0.4563, 0.5384},
                                     {-0.7311, 0.1937, 0.6173, 0.2236},
                                     {0.5124, 0.6308, -0.1729, 0.5561},
                                     {0.1453, 0.4019, 0.7466, -0.5098}};

/// What 64 bits can carry. These limits follow from rounding, not from any scene, and are not to be tuned.
struct RoundingLimits {
  double pivot = 1e-4;  // smallest over largest: below it the constraints keep too few of their digits
  double move = 1e-6;   // rad: a solution that the polish moves further came from a polynomial whose rounding
                        // may hide others
  double same = 1e-7;   // polished solutions nearer than this are one: at a double root rounding leaves them
                        // as far apart
  double exact = 1e-9;  // rad: the polish of a solution with a smaller error moves no point from before a
                        // camera to behind it
  double rough_tolerance = 1e-4;  // rad, added to the tolerance while a solution is rough
};
constexpr RoundingLimits kLimits{};

/// A basis of the (s, B) with x2^T E x1 = 0 for E = [s]x + parallax (B - tr(B) I), mirrored along `mirror`.
bool basis_of(const AlignedPairs& pairs, const Eigen::Vector4d& mirror, Row10 (&basis)[4]) {
  Row10 conditions[5];
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d &a = pairs.x1[i], &b = pairs.x2[i];
    const double cosine = a.dot(b);
    conditions[i] << a.cross(b) / pairs.parallax, b.x() * a.x() - cosine, b.y() * a.y() - cosine,
        b.z() * a.z() - cosine, b.y() * a.z() + b.z() * a.y(), b.x() * a.z() + b.z() * a.x(),
        b.x() * a.y() + b.y() * a.x(), 0;
    conditions[i].normalize();
  }
  return null_space<5>(conditions, mirror, basis);
}

Eigen::Matrix3d essential_of(const Row10& v, double scale) {
  const double trace = v[kB11] + v[kB22] + v[kB33];
  const double b23 = scale * v[kB23], b13 = scale * v[kB13], b12 = scale * v[kB12];
  Eigen::Matrix3d e;
  e << scale * (v[kB11] - trace), b12 - v[kS3], b13 + v[kS2],  //
      b12 + v[kS3], scale * (v[kB22] - trace), b23 - v[kS1],   //
      b13 - v[kS2], b23 + v[kS1], scale * (v[kB33] - trace);
  return e;
}

Eigen::Matrix3d half_turn_about(const Eigen::Vector3d& t) {
  return 2 * t * t.transpose() - Eigen::Matrix3d::Identity();
}

/// Receives the polished solutions, one motion of each essential matrix.
class EssentialSink {
 public:
  EssentialSink(const AlignedPairs& pairs, std::array<Eigen::Matrix3d, 10>* essentials)
      : pairs_(pairs), essentials_(essentials) {}

  /// Polishes and adds the solution. Returns how far off it was.
  double add_rough(Motion* motion, double) {
    orthonormalize(&motion->rotation);
    const double moved = polish(pairs_, motion);
    if (std::isfinite(moved)) add(*motion);
    return moved;
  }

  int count() const { return count_; }

 private:
  /// Unless it is there already (up to sign).
  void add(const Motion& motion) {
    Eigen::Matrix3d essential;
    for (int k = 0; k < 3; ++k) {
      essential.col(k) = std::sqrt(0.5) * motion.translation.cross(motion.rotation.col(k));
    }
    essential *= pairs_.turn;
    for (int i = 0; i < count_; ++i) {
      const double cosine = (*essentials_)[i].cwiseProduct(essential).sum();
      if (((*essentials_)[i] - std::copysign(1.0, cosine) * essential).squaredNorm() <
          kLimits.same * kLimits.same)
        return;
    }
    if (count_ < 10) (*essentials_)[count_++] = essential;
  }

  const AlignedPairs& pairs_;
  std::array<Eigen::Matrix3d, 10>* essentials_;
  int count_ = 0;
};

/// Receives the polished motions whose points are in front of both cameras.
class MotionSink {
 public:
  MotionSink(const AlignedPairs& pairs, double tolerance, std::array<Motion, 40>* motions)
      : pairs_(pairs), tolerance_(tolerance), motions_(motions) {}

  /// Polishes the solution where it needs that and adds those of its motions that have the points in front.
  /// Returns how far off it was.
  double add_rough(Motion* motion, double error) {
    const bool is_exact = error < kLimits.exact;
    Fronts fronts = fronts_of(*motion, pairs_, is_exact ? tolerance_ : tolerance_ + kLimits.rough_tolerance);
    if (!fronts.any()) return error;
    orthonormalize(&motion->rotation);
    error = polish(pairs_, motion);
    if (!std::isfinite(error)) return error;
    if (!is_exact) fronts = fronts_of(*motion, pairs_, tolerance_);
    add(*motion, fronts);
    return error;
  }

  int count() const { return count_; }

 private:
  void add(const Motion& motion, const Fronts& fronts) {
    const Eigen::Vector3d& t = motion.translation;
    const Eigen::Matrix3d rotation = motion.rotation * pairs_.turn;
    if (is_known(rotation, t)) return;
    if (fronts.as_is) put({rotation, t});
    if (fronts.reversed) put({rotation, -t});
    if (!fronts.twisted && !fronts.twisted_reversed) return;
    const Eigen::Matrix3d twisted = half_turn_about(t) * rotation;
    if (fronts.twisted) put({twisted, t});
    if (fronts.twisted_reversed) put({twisted, -t});
  }

  void put(const Motion& motion) {
    if (count_ < 40) (*motions_)[count_++] = motion;
  }

  /// Any of the four motions of one essential matrix is.
  bool is_known(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& t) const {
    for (int i = 0; i < count_; ++i) {
      const Motion& known = (*motions_)[i];
      if (known.translation.cross(t).squaredNorm() > kLimits.same * kLimits.same) continue;
      if ((known.rotation - rotation).squaredNorm() < kLimits.same * kLimits.same) return true;
      if ((known.rotation - half_turn_about(t) * rotation).squaredNorm() < kLimits.same * kLimits.same)
        return true;
    }
    return false;
  }

  const AlignedPairs& pairs_;
  double tolerance_;
  std::array<Motion, 40>* motions_;
  int count_ = 0;
};

/// Nister's method in the basis of the null space mirrored along `mirror`. Hands the solutions to the sink;
/// false when there is reason to think that some were lost to rounding.
template <class Sink>
bool solve_in_basis(const AlignedPairs& pairs, const Eigen::Vector4d& mirror, Sink* sink) {
  Row10 basis[4];
  if (!basis_of(pairs, mirror, basis)) return true;
  Constraints m = essential_constraints(basis, pairs.parallax);
  int rows[10];
  bool sound = eliminate(&m, rows) > kLimits.pivot;

  const ZSystem b = z_system(m, rows);
  double n[11];
  determinant(b, n);
  ProjectiveRoot roots[10];
  const int root_count = real_roots_degree10(n, roots);
  for (int i = 0; i < root_count; ++i) {
    const Eigen::Vector4d c = back_substitute(b, roots[i]);
    const Row10 solution = c[0] * basis[0] + c[1] * basis[1] + c[2] * basis[2] + c[3] * basis[3];
    Motion motion;
    const double error = rough_motion(essential_of(solution, pairs.parallax), &motion);
    if (!std::isfinite(error)) continue;
    const double moved = sink->add_rough(&motion, error);
    sound = sound && error < kLimits.move && moved < kLimits.move;
  }
  return sound && root_count % 2 == 0;
}

/// Solutions get lost where the elimination pivots badly or roots crowd, and that depends on the basis: what
/// one loses another finds.
template <class Sink>
int solve(const AlignedPairs& pairs, Sink sink) {
  for (const Eigen::Vector4d& mirror : kMirrors) {
    if (solve_in_basis(pairs, mirror, &sink)) break;
  }
  return sink.count();
}

}  // namespace

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               std::array<Eigen::Matrix3d, 10>* essentials) {
  std::array<Eigen::Vector3d, 5> unit1, unit2;
  for (int i = 0; i < 5; ++i) {
    unit1[i] = x1[i] / x1[i].norm();
    unit2[i] = x2[i] / x2[i].norm();
  }
  const AlignedPairs pairs = align(unit1, unit2);
  return solve(pairs, EssentialSink(pairs, essentials));
}

int five_point(const std::array<Eigen::Vector3d, 5>& x1, const std::array<Eigen::Vector3d, 5>& x2,
               double tolerance, std::array<Motion, 40>* motions) {
  const AlignedPairs pairs = align(x1, x2);
  return solve(pairs, MotionSink(pairs, tolerance, motions));
}

}  // namespace mono_pose_tracker
