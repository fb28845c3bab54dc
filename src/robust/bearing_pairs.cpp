#include "mono_pose_tracker/robust/bearing_pairs.h"

#include <numeric>
#include <utility>

#include "mono_pose_tracker/common/random.h"

namespace mono_pose_tracker {

namespace {

constexpr int kBlock = 64;  // pairs whose errors are computed at once; scoring may give up between blocks

struct BlockErrors {
  double squared[kBlock];  // Sampson errors, rad^2
  double along1[kBlock];   // t . R x1
  double along2[kBlock];   // t . x2
};

// e = x2 . (t x R x1) / sqrt(|t x R x1|^2 + |t x x2|^2): the distance, on both unit spheres together, to the
// nearest pair that satisfies the epipolar constraint.
void sampson_errors(const BearingPairs& pairs, const TwoViewModel& model, int begin, int count,
                    BlockErrors* block) {
  const Eigen::Vector3d& t = model.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d e = cross * model.rotation;
  const Eigen::Vector3d t1 = model.rotation.transpose() * t;
  const double *x1 = pairs.first(0, begin), *y1 = pairs.first(1, begin), *z1 = pairs.first(2, begin);
  const double *x2 = pairs.second(0, begin), *y2 = pairs.second(1, begin), *z2 = pairs.second(2, begin);
  const double e00 = e(0, 0), e01 = e(0, 1), e02 = e(0, 2), e10 = e(1, 0), e11 = e(1, 1), e12 = e(1, 2),
               e20 = e(2, 0), e21 = e(2, 1), e22 = e(2, 2);
  const double t1x = t1.x(), t1y = t1.y(), t1z = t1.z(), t2x = t.x(), t2y = t.y(), t2z = t.z();
  for (int i = 0; i < count; ++i) {
    const double constraint = x2[i] * (e00 * x1[i] + e01 * y1[i] + e02 * z1[i]) +
                              y2[i] * (e10 * x1[i] + e11 * y1[i] + e12 * z1[i]) +
                              z2[i] * (e20 * x1[i] + e21 * y1[i] + e22 * z1[i]);
    const double along1 = t1x * x1[i] + t1y * y1[i] + t1z * z1[i];
    const double along2 = t2x * x2[i] + t2y * y2[i] + t2z * z2[i];
    // The last term keeps a pair at both epipoles, which says nothing, from dividing zero by zero.
    block->squared[i] = constraint * constraint / (2 - along1 * along1 - along2 * along2 + 1e-15);
    block->along1[i] = along1;
    block->along2[i] = along2;
  }
}

// lambda1 R x1 + t = lambda2 x2 in the plane of the two rays: both distances, times sin^2 of the angle
// between the rays, are at least -tolerance * |t x x2|.
bool distances_positive(double along1, double along2, double cosine, double tolerance) {
  const double scaled1 = along2 * cosine - along1;
  const double scaled2 = along2 - along1 * cosine;
  const double slack = -tolerance * std::sqrt(std::max(0.0, 1 - along2 * along2));
  return scaled1 > slack && scaled2 > slack;
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  return angle < 1e-300 ? Eigen::Matrix3d::Identity().eval()
                        : Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

double truncated_cost(const BearingPairs& pairs, const TwoViewModel& model, double squared_threshold) {
  BlockErrors block;
  double cost = 0;
  for (int begin = 0; begin < pairs.size(); begin += kBlock) {
    const int count = std::min(kBlock, pairs.size() - begin);
    sampson_errors(pairs, model, begin, count, &block);
    for (int i = 0; i < count; ++i) {
      cost += std::min(block.squared[i], squared_threshold);
    }
  }
  return cost;
}

struct NormalEquations {
  Eigen::Matrix<double, 5, 5> information;
  Eigen::Matrix<double, 5, 1> gradient;
};

// Parameters: R' = exp(w) R, t' = (t + basis d) normalised; order w, d.
NormalEquations linearize(const BearingPairs& pairs, const TwoViewModel& model,
                          const Eigen::Matrix<double, 3, 2>& basis, double squared_threshold) {
  NormalEquations sum;
  sum.information.setZero();
  sum.gradient.setZero();
  const Eigen::Vector3d& t = model.translation;
  for (int i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d x2 = pairs.second(i);
    const Eigen::Vector3d r = model.rotation * pairs.first(i);
    const Eigen::Vector3d r_cross_x2 = r.cross(x2);
    const Eigen::Vector3d x2_cross_t = x2.cross(t);
    const double constraint = r.dot(x2_cross_t);
    const double along1 = t.dot(r);
    const double along2 = t.dot(x2);
    const double inverse = 1 / (2 - along1 * along1 - along2 * along2 + 1e-15);
    if (!(constraint * constraint * inverse < squared_threshold)) {
      continue;
    }
    const double scale = std::sqrt(inverse);
    const double shape = constraint * inverse;
    const Eigen::Vector3d by_translation = r_cross_x2 + shape * (along1 * r + along2 * x2);
    Eigen::Matrix<double, 5, 1> row;
    row.head<3>() = scale * r.cross(x2_cross_t + (shape * along1) * t);
    row.tail<2>() = scale * (basis.transpose() * by_translation);
    sum.information.selfadjointView<Eigen::Lower>().rankUpdate(row);
    sum.gradient += (scale * constraint) * row;
  }
  return sum;
}

}  // namespace

BearingPairs::BearingPairs(const std::vector<Eigen::Vector3d>& bearings1,
                           const std::vector<Eigen::Vector3d>& bearings2, std::uint64_t seed) {
  for (std::size_t i = 0; i < bearings1.size(); ++i) {
    const double norms = bearings1[i].norm() * bearings2[i].norm();
    if (std::isfinite(norms) && norms > 0) {
      source_.push_back(static_cast<int>(i));
    }
  }
  Random random(seed);
  for (int i = size() - 1; i > 0; --i) {
    std::swap(source_[i], source_[random.index(static_cast<std::uint32_t>(i + 1))]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    first_[axis].resize(source_.size());
    second_[axis].resize(source_.size());
  }
  for (int i = 0; i < size(); ++i) {
    const Eigen::Vector3d x1 = bearings1[source_[i]].normalized();
    const Eigen::Vector3d x2 = bearings2[source_[i]].normalized();
    for (int axis = 0; axis < 3; ++axis) {
      first_[axis][i] = x1[axis];
      second_[axis][i] = x2[axis];
    }
  }
}

bool may_be_in_front(const TwoViewModel& model, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2, double tolerance) {
  const Eigen::Vector3d r = model.rotation * bearing1;
  return distances_positive(model.translation.dot(r), model.translation.dot(bearing2), r.dot(bearing2),
                            tolerance);
}

RansacScore score_two_views(const BearingPairs& pairs, const TwoViewModel& model, double threshold,
                            double cost_bound, std::vector<char>* inliers) {
  const double squared_threshold = threshold * threshold;
  if (inliers != nullptr) {
    inliers->assign(pairs.size(), 0);
  }
  RansacScore score;
  score.cost = 0;
  BlockErrors block;
  for (int begin = 0; begin < pairs.size() && score.cost < cost_bound; begin += kBlock) {
    const int count = std::min(kBlock, pairs.size() - begin);
    sampson_errors(pairs, model, begin, count, &block);
    for (int i = 0; i < count; ++i) {
      if (!(block.squared[i] < squared_threshold)) {
        score.cost += squared_threshold;
        continue;
      }
      const double cosine = (model.rotation * pairs.first(begin + i)).dot(pairs.second(begin + i));
      if (!distances_positive(block.along1[i], block.along2[i], cosine, threshold)) {
        score.cost += squared_threshold;
        continue;
      }
      score.cost += block.squared[i];
      ++score.num_inliers;
      if (inliers != nullptr) {
        (*inliers)[begin + i] = 1;
      }
    }
  }
  return score;
}

double refine_two_views(const BearingPairs& pairs, double threshold, int max_iterations,
                        TwoViewModel* model) {
  const double squared_threshold = threshold * threshold;
  double cost = truncated_cost(pairs, *model, squared_threshold);
  double damping = 1e-4;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Eigen::Matrix<double, 3, 2> basis = tangent_basis(model->translation);
    const NormalEquations equations = linearize(pairs, *model, basis, squared_threshold);
    double previous = cost;
    while (damping < 1e6) {
      Eigen::Matrix<double, 5, 5> damped = equations.information;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-12;  // keeps directions that no pair constrains solvable
      const Eigen::Matrix<double, 5, 1> step =
          -damped.selfadjointView<Eigen::Lower>().ldlt().solve(equations.gradient);
      TwoViewModel candidate;
      candidate.rotation = rotation_of(step.head<3>()) * model->rotation;
      candidate.translation = (model->translation + basis * step.tail<2>()).normalized();
      const double candidate_cost = truncated_cost(pairs, candidate, squared_threshold);
      if (candidate_cost < cost) {
        *model = candidate;
        cost = candidate_cost;
        damping = std::max(1e-8, damping * 0.1);
        break;
      }
      damping *= 10;
    }
    if (!(previous - cost > 1e-6 * cost)) {
      break;  // less than the sixth digit of the cost moves the pose far below its uncertainty
    }
  }
  return cost;
}

}  // namespace mono_pose_tracker
