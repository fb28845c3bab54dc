#include "robust/two_view_ambiguity.h"

#include <Eigen/Dense>
#include <array>
#include <limits>

#include "common/rotation.h"
#include "common/toolchain.h"
#include "geometry/nearest_rotation.h"
#include "robust/sampler.h"

namespace mono_pose_tracker {

namespace {

// A fit within a set that already agrees on a pose: a few hundred samples find half the set with 2 or 3 draws
// each.
RansacOptions fit_options(double threshold, std::uint64_t seed) {
  RansacOptions options;
  options.threshold = threshold;
  options.confidence = 0.999;
  options.min_iterations = 10;
  options.max_iterations = 100;
  options.seed = seed;
  return options;
}

// Half the squared angles between the second bearings of a block and the mapped first ones, whose map is
// given row by row: the noise of both views adds up in them, which makes them comparable with Sampson errors.
// One is added where the map is to the other side.
MPT_FUNCTION_CLONES_FOR("avx2")
void transfer_errors(const PairBlock& block, const double (&h)[9], double (&__restrict squared)[kBlockSize]) {
  const auto& [x1, x2] = block;
  for (int i = 0; i < kBlockSize; ++i) {
    const double x = h[0] * x1[0][i] + h[1] * x1[1][i] + h[2] * x1[2][i];
    const double y = h[3] * x1[0][i] + h[4] * x1[1][i] + h[5] * x1[2][i];
    const double z = h[6] * x1[0][i] + h[7] * x1[1][i] + h[8] * x1[2][i];
    const double u = x2[0][i], v = x2[1][i], w = x2[2][i];
    const double nx = y * w - z * v, ny = z * u - x * w, nz = x * v - y * u;
    const double cosine = x * u + y * v + z * w;
    squared[i] = 0.5 * (nx * nx + ny * ny + nz * nz) / (x * x + y * y + z * z) + (cosine > 0 ? 0 : 1);
  }
}

// MSAC over the pairs of a map from first to second bearings.
RansacScore score_map(const BearingPairs& pairs, const Eigen::Matrix3d& map, double threshold,
                      double cost_bound, std::vector<char>* inliers = nullptr) {
  double rows[9];
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows) << map;
  const auto squared_of = [&](int begin, double(&squared)[kBlockSize]) {
    transfer_errors(PairBlock(pairs, begin), rows, squared);
  };
  return score_pairs(pairs.size(), threshold, cost_bound, squared_of, inliers);
}

std::vector<char> mapped_pairs(const BearingPairs& pairs, const Eigen::Matrix3d& map, double threshold) {
  std::vector<char> inliers;
  score_map(pairs, map, threshold, std::numeric_limits<double>::infinity(), &inliers);
  return inliers;
}

// With the motion known, n . x1 is the inverse distance of the point along x1, in units of the baseline.
struct PlaneEstimator {
  using Model = Eigen::Vector3d;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 1;

  PlaneEstimator(const BearingPairs& pairs, const TwoViewModel& motion, double threshold)
      : pairs(pairs), motion(motion), threshold(threshold) {
    for (int i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector3d across = pairs.second()[i].cross(motion.translation);
      const Eigen::Vector3d shift = pairs.second()[i].cross(motion.rotation * pairs.first()[i]);
      inverse_distance.push_back(-across.dot(shift) / std::max(across.squaredNorm(), 1e-12));
    }
  }

  int num_data() const { return pairs.size(); }

  int solve(const std::array<int, 3>& sample, std::array<Eigen::Vector3d, 1>* models) const {
    Eigen::Matrix3d a;
    Eigen::Vector3d b;
    for (int k = 0; k < 3; ++k) {
      a.row(k) = pairs.first()[sample[k]];
      b[k] = inverse_distance[sample[k]];
    }
    (*models)[0] = a.inverse() * b;
    return (*models)[0].allFinite() ? 1 : 0;
  }

  Eigen::Matrix3d homography(const Eigen::Vector3d& normal) const {
    return motion.rotation + motion.translation * normal.transpose();
  }

  RansacScore score(const Eigen::Vector3d& normal, double cost_bound) const {
    return score_map(pairs, homography(normal), threshold, cost_bound);
  }

  // Linear least squares of the inverse distances, weighted with how well the pair fixes each (its angle to
  // t).
  void optimize(Eigen::Vector3d* normal) const {
    const Eigen::Matrix3d map = homography(*normal);
    const std::vector<char> inliers = mapped_pairs(pairs, map, threshold);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (int i = 0; i < pairs.size(); ++i) {
      if (!inliers[i]) continue;
      const Eigen::Vector3d x1 = pairs.first()[i];
      const double weight =
          pairs.second()[i].cross(motion.translation).squaredNorm() / (map * x1).squaredNorm();
      a += weight * x1 * x1.transpose();
      b += weight * inverse_distance[i] * x1;
    }
    const Eigen::Vector3d refined = a.ldlt().solve(b);
    if (refined.allFinite()) {
      *normal = refined;
    }
  }

  bool is_equivalent(const Eigen::Vector3d&, const Eigen::Vector3d&) const { return false; }

  const BearingPairs& pairs;
  const TwoViewModel& motion;
  double threshold;
  std::vector<double> inverse_distance;
};

// Axes along the bisector of two directions and their normal. The rotation from one such frame to another is
// the best for both directions equally (Markley 2002, Fast quaternion attitude estimation from two vector
// measurements).
Eigen::Matrix3d frame_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d bisector = (a + b).normalized(), normal = a.cross(b).normalized();
  Eigen::Matrix3d frame;
  frame << bisector, normal.cross(bisector), normal;
  return frame;
}

struct RotationEstimator {
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 2;
  static constexpr int kMaxModels = 1;

  int num_data() const { return pairs.size(); }

  int solve(const std::array<int, 2>& sample, std::array<Eigen::Matrix3d, 1>* models) const {
    const VectorArray &x1 = pairs.first(), &x2 = pairs.second();
    const int i = sample[0], j = sample[1];
    (*models)[0] = frame_of(x2[i], x2[j]) * frame_of(x1[i], x1[j]).transpose();
    return (*models)[0].determinant() > 0.5 ? 1 : 0;  // none of directions that are parallel
  }

  RansacScore score(const Eigen::Matrix3d& rotation, double cost_bound) const {
    return score_map(pairs, rotation, threshold, cost_bound);
  }

  void optimize(Eigen::Matrix3d* rotation) const {
    const std::vector<char> inliers = mapped_pairs(pairs, *rotation, threshold);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int i = 0; i < pairs.size(); ++i) {
      if (inliers[i]) sum += pairs.second()[i] * pairs.first()[i].transpose();
    }
    *rotation = nearest_rotation(sum);
  }

  bool is_equivalent(const Eigen::Matrix3d&, const Eigen::Matrix3d&) const { return false; }

  const BearingPairs& pairs;
  double threshold;
};

}  // namespace

PlaneFit fit_plane(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                   std::uint64_t seed) {
  PlaneEstimator estimator(pairs, model, threshold);
  PlaneFit fit;
  if (estimator.num_data() < PlaneEstimator::kSampleSize) {
    return fit;
  }
  UniformSampler sampler(estimator.num_data(), PlaneEstimator::kSampleSize);
  const auto report = ransac(fit_options(threshold, seed), estimator, sampler);
  if (std::isfinite(report.best.score.cost)) {
    fit.normal = report.best.model;
    fit.num_inliers = report.best.score.num_inliers;
  }
  return fit;
}

bool second_planar_solution(const TwoViewModel& model, const Eigen::Vector3d& normal, TwoViewModel* second) {
  // H = R (I + s n^T), and H^T H = I + n u^T + u n^T with u = s + |s|^2 n / 2 does not know n from u.
  const Eigen::Vector3d s = model.rotation.transpose() * model.translation;
  const Eigen::Vector3d u = s + 0.5 * s.squaredNorm() * normal;
  const double u_norm = u.norm();
  if (!(u_norm > 1e-9) || !(normal.norm() > 1e-9)) {
    return false;
  }
  const Eigen::Vector3d second_normal = u / u_norm;
  // Of the two s' that solve u' = s' + |s'|^2 n' / 2 for u' = |u| n, the one that leaves det H as it is.
  const Eigen::Vector3d second_s =
      u_norm * normal - 0.5 * s.squaredNorm() * normal.squaredNorm() * second_normal;
  const Eigen::Matrix3d homography = model.rotation * (Eigen::Matrix3d::Identity() + s * normal.transpose());
  const Eigen::Matrix3d stretch = Eigen::Matrix3d::Identity() + second_s * second_normal.transpose();
  if (!(std::abs(stretch.determinant()) > 1e-9) || !(second_s.norm() > 1e-9)) {
    return false;
  }
  second->rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(homography * stretch.inverse())).normalized().toRotationMatrix();
  second->translation = (second->rotation * second_s).normalized();
  return second->rotation.allFinite();
}

bool turn_scaled(const BearingPairs& pairs, const TwoViewModel& model, double factor, TwoViewModel* scaled) {
  Eigen::Vector3d middle1 = Eigen::Vector3d::Zero(), middle2 = Eigen::Vector3d::Zero();
  for (int i = 0; i < pairs.size(); ++i) {
    middle1 += pairs.first()[i];
    middle2 += pairs.second()[i];
  }
  middle1.normalize();
  middle2.normalize();
  // Distances of the middle point from both cameras: lambda1 R m1 + t = lambda2 m2 in the least squares
  // sense.
  Eigen::Matrix<double, 3, 2> rays;
  rays << model.rotation * middle1, -middle2;
  const Eigen::Vector2d distances =
      -(rays.transpose() * rays).ldlt().solve(rays.transpose() * model.translation);
  if (!distances.allFinite() || !(distances.minCoeff() > 0)) {
    return false;
  }
  // R = A Rz(a) Ry(turn) Rz(b) B^T, with A and B looking along the middle of each view.
  const Eigen::Matrix3d a = rotation_between(Eigen::Vector3d::UnitZ(), middle2);
  const Eigen::Matrix3d b = rotation_between(Eigen::Vector3d::UnitZ(), middle1);
  const Eigen::Vector3d angles = (a.transpose() * model.rotation * b).eulerAngles(2, 1, 2);
  const Eigen::Matrix3d turned = (Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(factor * angles[1], Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(angles[2], Eigen::Vector3d::UnitZ()))
                                     .toRotationMatrix();
  scaled->rotation = a * turned * b.transpose();
  const Eigen::Vector3d translation = distances[1] * middle2 - distances[0] * (scaled->rotation * middle1);
  scaled->translation = translation.normalized();
  return translation.norm() > 1e-9 && scaled->rotation.allFinite();
}

RotationFit fit_rotation(const BearingPairs& pairs, double threshold, std::uint64_t seed) {
  RotationEstimator estimator{pairs, threshold};
  RotationFit fit;
  if (estimator.num_data() < RotationEstimator::kSampleSize) {
    return fit;
  }
  UniformSampler sampler(estimator.num_data(), RotationEstimator::kSampleSize);
  const auto report = ransac(fit_options(threshold, seed), estimator, sampler);
  if (std::isfinite(report.best.score.cost)) {
    fit.rotation = report.best.model;
    fit.num_inliers = report.best.score.num_inliers;
  }
  return fit;
}

}  // namespace mono_pose_tracker
