#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "bundle_solvers.h"
#include "common/threads.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

/// Limits of ReducedBundle and solve_reduced.
struct ReducedBundleOptions {
  double min_curvature_ratio = PointStepOptions().min_curvature_ratio;
  // Mean of log(1 + s / width^2) over squared residuals s above which those of a point are more than noise:
  // all residuals at 1.1 widths. Noise with 10 % outliers stays below.
  double out_of_place = 0.8;
  // The same mean over the whole problem above which its cameras may be far from the solution: all residuals
  // at 1.3 widths. Where most features are more precise than their sigmas the distribution has long tails,
  // and noise reaches 0.85.
  double far_off = 1;

  // Points. Shares are of the squared loss width (two sigmas squared, by default).
  int point_steps = 20;           // Newton steps: one or two are usual near the minimum
  double point_tolerance = 1e-6;  // a step with a smaller reduction of the cost moves a point by a few
                                  // thousandths of its standard deviation
  double suspicious_rise = 0.1;   // of the cost of a point, above which its prediction may have been wrong
  double damping = 1e-9;          // relative: enough to decompose a matrix with unconstrained directions

  // Cameras. The work on the reduced matrix, which is treated as dense, grows with the cube: with 400 cameras
  // it is 5e9 multiplications an iteration.
  std::size_t max_cameras = 400;
  double min_decrease_ratio = 1e-3;  // of the cost's decrease to the predicted one, for an accepted step
  double min_radius = 1e-32;         // of the trust region
  double min_step = 1e-8;            // relative to the parameters: a shorter step ends the search

  // Threads.
  int points_at_once = 32;           // handed to a thread: handing them out takes 1 % of their time
  std::size_t rays_per_part = 1000;  // above which filling the matrix in parallel pays
};

// Bundle problem as a function of its free cameras alone: the points are always at their optimum for these
// cameras (variable projection; Golub and Pereyra 1973), found by separate Newton steps. A point that
// converges slowly (narrow parallax, or two local minima of the loss) thus delays no other. For problems
// whose residuals are mostly noise: while cameras are far from the solution, points would settle too early in
// local minima.
class ReducedBundle {
 public:
  // loss_width > 0; the parameters are the blocks of the free cameras, one after the other. All observations
  // are used; a point with a single one stays. threads: the results are the same for any number.
  ReducedBundle(double loss_width, const BundleCameras& cameras, const BundleProblem& problem,
                int threads = 1, const ReducedBundleOptions& limits = {});

  int parameters() const { return 6 * static_cast<int>(free_.size()); }
  double initial_cost() const { return initial_cost_; }
  bool is_near_noise() const;

  // The cost at these parameters, after the points have followed from their accepted positions.
  double evaluate(const double* parameters);

  // Accepts the points of the last evaluation. A small change d of the parameters then costs g . d + d . S d
  // / 2; information: S, its lower triangle; gradient: g.
  void linearize(Eigen::MatrixXd* information, Eigen::VectorXd* gradient);

  // As accepted.
  const std::vector<Eigen::Vector3d>& points() const { return accepted_; }

 private:
  struct ViewingRay {
    int camera;  // of all
    int free;    // of the free ones, or -1
    Eigen::Vector3d bearing;
    Eigen::Matrix<double, 2, 3> weighted;  // pixel_from_bearing / sigma_px
  };
  // Cost and derivatives of a point for the present cameras.
  struct PointState {
    double cost = 0;
    Eigen::Matrix3d information;
    Eigen::Vector3d gradient;
  };
  // Newton step of an accepted point, by which it follows a small motion of its cameras.
  struct Follower {
    Eigen::Matrix3d factor;    // of its information, lower triangle
    Eigen::Vector3d residual;  // factor^-1 gradient
  };
  using CameraByPoint = Eigen::Matrix<double, 6, 3>;
  // Residual of an observation by a free camera, and its derivative by the camera's pose (rotation about its
  // centre, translation).
  struct PoseTerm {
    Eigen::Matrix<double, 2, 6> by_pose;
    Eigen::Vector2d residual;
  };
  // Every step-th free camera from `first` on: the columns of the matrix that one thread fills.
  struct Part {
    int first, step;
    bool has(int camera) const { return camera % step == first; }
  };

  bool is_noise(double cost, int num_rays) const;
  PointState state_of(std::size_t point, const Eigen::Vector3d& x) const;
  Eigen::Vector3d predict(std::size_t point) const;
  PointState begin_at(std::size_t point, Eigen::Vector3d* x) const;
  double settle(std::size_t point);
  void linearize_point(std::size_t point);
  void factorize_point(std::size_t point, const PointState& joint);
  void fill(const Part& part, Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const;
  void eliminate_point(std::size_t point, const Part& part, Eigen::MatrixXd* information,
                       Eigen::VectorXd* gradient) const;
  void to_parameters(Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const;

  const Loss loss_;
  const double squared_width_;
  const ReducedBundleOptions limits_;
  ThreadTeam team_;
  std::vector<CameraState> cameras_;
  const std::vector<int> free_;
  std::vector<int> begin_;  // rays of point p: from begin_[p] up to begin_[p + 1]
  std::vector<ViewingRay> rays_;
  std::vector<int> free_of_;  // by camera, or -1
  double initial_cost_ = 0;

  std::vector<Eigen::Vector3d> candidate_;  // of the last evaluation
  std::vector<double> candidate_costs_, candidate_parameters_;

  bool linearized_ = false;
  std::vector<Eigen::Vector3d> accepted_;
  std::vector<double> accepted_costs_, accepted_parameters_;
  std::vector<Eigen::Matrix3d> left_jacobians_;  // of the free cameras
  std::vector<Follower> followers_;
  // For the viewing rays of free cameras, filled by linearize_point. Not initialised: megabytes, which the
  // threads that fill them also allocate.
  std::unique_ptr<CameraByPoint[]> by_point_;  // second derivatives, times factor^-T
  std::unique_ptr<PoseTerm[]> pose_terms_;
  std::vector<Eigen::Matrix<double, 6, 1>> moved_;  // the free cameras, since
};

// Solves for the cameras with the points eliminated (ReducedBundle), with the loss. The result is written to
// the cameras' blocks and the problem's points; all observations are used. Nothing, and nothing changed, if
// the problem is unsuitable: too many free cameras, or residuals above noise.
std::optional<BundleReport> solve_reduced(const BundleOptions& options, BundleCameras* cameras,
                                          BundleProblem* problem, const ReducedBundleOptions& limits = {});

}  // namespace mono_pose_tracker
