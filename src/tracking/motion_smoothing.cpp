#include "motion_smoothing.h"

#include <Eigen/Cholesky>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <array>
#include <utility>

namespace mono_pose_tracker {

namespace {

// Reweighted least squares: the weights of what is far off settle to a per cent in so many.
constexpr int kRounds = 20;

// A change of velocity at the middle of three centers: the sum of weight times center, in sigmas.
struct Change {
  std::size_t first;
  std::array<double, 3> weights;
};

// Huber's. What is usual counts here: the images say nothing better.
double weight_of(double sigmas) { return sigmas <= kMotionLossWidth ? 1 : kMotionLossWidth / sigmas; }

// Of each three in a row of which one may move.
std::vector<Change> changes_in(const MotionPrior& prior, const std::vector<UncertainCenter>& centers) {
  std::vector<Change> changes;
  for (std::size_t i = 0; i + 2 < centers.size(); ++i) {
    if (centers[i].is_held && centers[i + 1].is_held && centers[i + 2].is_held) continue;
    const VelocityChange change(centers[i], centers[i + 1], centers[i + 2]);
    if (!change.is_timed()) continue;
    const double before = 1 / change.seconds_before, after = 1 / change.seconds_after;
    const double sigma = prior.sigma_of(change);
    changes.push_back({i, {before / sigma, -(before + after) / sigma, after / sigma}});
  }
  return changes;
}

class Smoother {
 public:
  Smoother(const MotionPrior& prior, const std::vector<UncertainCenter>& centers)
      : centers_(centers), changes_(changes_in(prior, centers)), unknown_(centers.size(), -1) {
    for (std::size_t i = 0; i < centers.size(); ++i) {
      if (centers[i].is_held) continue;
      // A singular covariance says nothing: that center stays, the others are smoothed.
      const Eigen::Matrix3d information = centers[i].covariance.inverse();
      if (!information.allFinite()) continue;
      unknown_[i] = unknowns_++;
      information_.push_back(information);
    }
    shifts_ = Eigen::VectorXd::Zero(3 * unknowns_);
  }

  // False where nothing can be said.
  bool solve() {
    for (int round = 0; round < kRounds && unknowns_ > 0; ++round) {
      if (!step()) return false;
    }
    return true;
  }

  Eigen::Vector3d smoothed(std::size_t i) const {
    return unknown_[i] < 0 ? centers_[i].center : centers_[i].center + shifts_.segment<3>(3 * unknown_[i]);
  }

 private:
  bool step() {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3 * unknowns_);
    for (int u = 0; u < unknowns_; ++u) {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
          entries.emplace_back(3 * u + row, 3 * u + column, information_[u](row, column));
      }
    }
    for (const Change& change : changes_) add(change, &entries, &right);
    Eigen::SparseMatrix<double> normal(3 * unknowns_, 3 * unknowns_);
    normal.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
    if (factor.info() != Eigen::Success) return false;
    shifts_ = factor.solve(right);
    return shifts_.allFinite();
  }

  // weights . (center + shift) is to be small, as its size now says how much.
  void add(const Change& change, std::vector<Eigen::Triplet<double>>* entries, Eigen::VectorXd* right) const {
    Eigen::Vector3d now = Eigen::Vector3d::Zero(), unmoved = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      now += change.weights[k] * smoothed(change.first + k);
      unmoved += change.weights[k] * centers_[change.first + k].center;
    }
    const double slope = weight_of(now.norm());
    for (std::size_t k = 0; k < 3; ++k) {
      const int row = unknown_[change.first + k];
      if (row < 0) continue;
      right->segment<3>(3 * row) -= slope * change.weights[k] * unmoved;
      for (std::size_t l = 0; l < 3; ++l) {
        const int column = unknown_[change.first + l];
        if (column < 0) continue;
        const double entry = slope * change.weights[k] * change.weights[l];
        for (int axis = 0; axis < 3; ++axis) entries->emplace_back(3 * row + axis, 3 * column + axis, entry);
      }
    }
  }

  const std::vector<UncertainCenter>& centers_;
  const std::vector<Change> changes_;
  std::vector<int> unknown_;  // by center, or -1
  int unknowns_ = 0;
  std::vector<Eigen::Matrix3d> information_;  // of the images, by unknown
  Eigen::VectorXd shifts_;
};

}  // namespace

std::vector<TimedCenter> centers_of(const std::vector<RegisteredFrame>& frames) {
  std::vector<TimedCenter> centers;
  for (const RegisteredFrame& frame : frames) {
    centers.push_back({frame.stamp_ns, frame.map_from_camera.translation});
  }
  return centers;
}

void smooth_centers(const MotionPrior& prior, std::vector<UncertainCenter>* in_time) {
  if (!prior) return;
  Smoother smoother(prior, *in_time);
  if (!smoother.solve()) return;
  std::vector<Eigen::Vector3d> smoothed;
  for (std::size_t i = 0; i < in_time->size(); ++i) smoothed.push_back(smoother.smoothed(i));
  for (std::size_t i = 0; i < in_time->size(); ++i) (*in_time)[i].center = smoothed[i];
}

}  // namespace mono_pose_tracker
