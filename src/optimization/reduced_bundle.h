#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "bundle_cameras.h"
#include "common/thread_team.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "motion_residual.h"
#include "reprojection.h"

namespace mono_pose_tracker {

// A bundle problem as a function of its free cameras alone: the points are wherever they fit these best
// (variable projection; Golub and Pereyra 1973), each found by Newton steps of its own. So a point that
// converges slowly, for its narrow parallax or since the loss holds it between two places, delays no other,
// and the only parameters are those of the cameras. For problems whose residuals are mostly noise: while
// cameras are far off, points that follow them side too soon with some of them.
class ReducedBundle {
 public:
  // loss_width > 0; the parameters are the blocks of the free cameras, one after the other. All observations
  // of the problem are heeded; a point with only one stays where it is. threads: the results are the same for
  // any number.
  ReducedBundle(double loss_width, const BundleCameras& cameras, const BundleProblem& problem,
                int threads = 1);

  int parameters() const { return 6 * static_cast<int>(free_.size()); }
  double initial_cost() const { return initial_cost_; }
  bool is_near_noise() const;

  // The cost at these parameters, the points having followed from where they were last accepted.
  double evaluate(const double* parameters);

  // Accepts the points of the last evaluation. A small change d of the parameters then costs g . d + d . S d
  // / 2, with S = L L^T and g = L r; factor: L; residual: r. False where S is not positive.
  bool linearize(Eigen::MatrixXd* factor, Eigen::VectorXd* residual);

  // As accepted.
  const std::vector<Eigen::Vector3d>& points() const { return accepted_; }

 private:
  struct ViewingRay {
    int camera;  // of all
    int free;    // of the free ones, or -1
    Eigen::Vector3d bearing;
    Eigen::Matrix<double, 2, 3> weighted;  // pixel_from_bearing / sigma_px
  };
  // A point under the present cameras.
  struct PointState {
    double cost = 0;
    Eigen::Matrix3d information;
    Eigen::Vector3d gradient;
  };
  // Of an accepted point; it goes to where its gradient vanishes when its cameras have moved a little.
  struct Follower {
    Eigen::Matrix3d factor;    // of its information, lower triangle
    Eigen::Vector3d residual;  // factor^-1 gradient
  };
  using CameraByPoint = Eigen::Matrix<double, 6, 3>;
  // Of an observation by a free camera: what its residual is, and changes by with the camera's pose (a turn
  // where it is, a movement).
  struct PoseTerm {
    Eigen::Matrix<double, 2, 6> by_pose;
    Eigen::Vector2d residual;
  };
  // Of the free cameras, one in so many, whose columns of the matrix one thread fills.
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
  double cost_of_motions() const;
  void add_motions(Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const;
  void to_parameters(Eigen::MatrixXd* information, Eigen::VectorXd* gradient) const;

  const Loss loss_;
  const double squared_width_;
  ThreadTeam team_;
  std::vector<CameraState> cameras_;
  const std::vector<int> free_;
  std::vector<int> begin_;  // sights of point p: from begin_[p] up to begin_[p + 1]
  std::vector<ViewingRay> rays_;
  std::vector<BundleMotion> motions_;
  std::vector<int> free_of_;                   // by camera, or -1
  double points_cost_ = 0, initial_cost_ = 0;  // of the points, and with the motions

  std::vector<Eigen::Vector3d> candidate_;  // of the last evaluation
  std::vector<double> candidate_costs_, candidate_parameters_;

  bool linearized_ = false;
  std::vector<Eigen::Vector3d> accepted_;
  std::vector<double> accepted_costs_, accepted_parameters_;
  std::vector<Eigen::Matrix3d> left_jacobians_;  // of the free cameras
  std::vector<Follower> followers_;
  // Of sights by free cameras, as linearize_point leaves them; before that nothing: megabytes, which the
  // threads that fill them also get from the system.
  std::unique_ptr<CameraByPoint[]> by_point_;  // second derivatives, times factor^-T
  std::unique_ptr<PoseTerm[]> pose_terms_;
  std::vector<Eigen::Matrix<double, 6, 1>> moved_;  // the free cameras, since
};

}  // namespace mono_pose_tracker
