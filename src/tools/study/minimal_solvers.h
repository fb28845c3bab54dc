#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <string>
#include <vector>

#ifdef MONO_POSE_TRACKER_WITH_OPENGV
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>
#endif

#ifdef MONO_POSE_TRACKER_WITH_POSELIB
#include <PoseLib/camera_pose.h>
#include <PoseLib/solvers/p3p.h>
#include <PoseLib/solvers/relpose_5pt.h>
#endif

#include "geometry/essential.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/geometry/five_point.h"
#include "mono_pose_tracker/geometry/p3p.h"
#include "mono_pose_tracker/geometry/seven_point.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {

/// A minimal solver, ours or a peer's, on problems put into its own types beforehand, so that only solving is
/// timed.
template <class Problem, class Solution>
struct MinimalSolver {
  /// Both take the index of a problem: the number of solutions, and the solutions themselves.
  struct Prepared {
    std::function<int(std::size_t)> run;
    std::function<std::vector<Solution>(std::size_t)> solutions;
  };
  std::string name;
  std::function<Prepared(const std::vector<Problem>&)> prepare;
};

template <int N>
struct BearingSample {
  std::array<Eigen::Vector3d, N> bearings1, bearings2;
};

template <int N>
using EpipolarSolver = MinimalSolver<BearingSample<N>, Eigen::Matrix3d>;
using PoseSolver = MinimalSolver<PoseProblem, Rigid3>;

/// Wraps a solver of ours, which writes into an array of what `convert` makes our solutions of.
template <class Problem, class Solution, class Found, std::size_t kMost, class Solve, class Convert>
MinimalSolver<Problem, Solution> own_solver(const std::string& name, Solve solve, Convert convert) {
  using Solver = MinimalSolver<Problem, Solution>;
  return {name, [=](const std::vector<Problem>& problems) -> typename Solver::Prepared {
            const auto run = [&problems, solve](std::size_t i) {
              std::array<Found, kMost> found;
              return solve(problems[i], &found);
            };
            const auto solutions = [&problems, solve, convert](std::size_t i) {
              std::array<Found, kMost> found;
              const int count = solve(problems[i], &found);
              std::vector<Solution> converted;
              for (int k = 0; k < count; ++k) converted.push_back(convert(found[k]));
              return converted;
            };
            return {run, solutions};
          }};
}

/// Wraps a peer: `convert` makes its input, `solve` calls it, `read` makes our solutions of its output.
template <class Problem, class Solution, class Convert, class Solve, class Read>
MinimalSolver<Problem, Solution> peer_solver(const std::string& name, Convert convert, Solve solve,
                                             Read read) {
  using Solver = MinimalSolver<Problem, Solution>;
  return {name, [=](const std::vector<Problem>& problems) -> typename Solver::Prepared {
            using Input = decltype(convert(problems[0]));
            auto inputs = std::make_shared<std::vector<Input>>();
            for (const Problem& problem : problems) inputs->push_back(convert(problem));
            return {[inputs, solve](std::size_t i) { return static_cast<int>(solve((*inputs)[i]).size()); },
                    [inputs, solve, read](std::size_t i) { return read(solve((*inputs)[i])); }};
          }};
}

struct ImagePoints {
  std::vector<cv::Point2d> first, second;
};

template <int N>
ImagePoints to_opencv(const BearingSample<N>& sample) {
  ImagePoints points;
  for (int i = 0; i < N; ++i) {
    const Eigen::Vector2d x1 = sample.bearings1[i].hnormalized(), x2 = sample.bearings2[i].hnormalized();
    points.first.emplace_back(x1.x(), x1.y());
    points.second.emplace_back(x2.x(), x2.y());
  }
  return points;
}

/// OpenCV stacks 3x3 matrices on one another.
inline std::vector<Eigen::Matrix3d> split_stack(const cv::Mat& stack) {
  std::vector<Eigen::Matrix3d> matrices;
  for (int row = 0; row + 3 <= stack.rows; row += 3) {
    Eigen::Matrix3d matrix;
    cv::cv2eigen(stack.rowRange(row, row + 3), matrix);
    matrices.push_back(matrix.normalized());
  }
  return matrices;
}

#ifdef MONO_POSE_TRACKER_WITH_OPENGV

struct OpengvBearings {
  opengv::bearingVectors_t first, second;
};

template <int N>
OpengvBearings to_opengv(const BearingSample<N>& sample) {
  return {{sample.bearings1.begin(), sample.bearings1.end()},
          {sample.bearings2.begin(), sample.bearings2.end()}};
}

/// OpenGV's essential matrices map the second view's bearings into the first: the transposes of ours.
inline std::vector<Eigen::Matrix3d> from_opengv(const opengv::essentials_t& essentials) {
  std::vector<Eigen::Matrix3d> matrices;
  for (const Eigen::Matrix3d& e : essentials) matrices.push_back(e.transpose().normalized());
  return matrices;
}

/// Real ones only: a complex part of a millionth is rounding.
inline std::vector<Eigen::Matrix3d> from_opengv(const opengv::complexEssentials_t& essentials) {
  std::vector<Eigen::Matrix3d> matrices;
  for (const auto& e : essentials) {
    if (e.imag().norm() < 1e-6 * e.norm()) matrices.push_back(e.real().transpose().normalized());
  }
  return matrices;
}

template <int N, class Method>
EpipolarSolver<N> opengv_epipolar_solver(const std::string& name, Method method) {
  const auto solve = [method](const OpengvBearings& bearings) {
    const opengv::relative_pose::CentralRelativeAdapter adapter(bearings.first, bearings.second);
    return method(adapter);
  };
  return peer_solver<BearingSample<N>, Eigen::Matrix3d>(name, to_opengv<N>, solve,
                                                        [](const auto& found) { return from_opengv(found); });
}

struct OpengvPoints {
  opengv::bearingVectors_t bearings;
  opengv::points_t points;
};

template <class Method>
PoseSolver opengv_pose_solver(const std::string& name, Method method) {
  const auto convert = [](const PoseProblem& sample) -> OpengvPoints {
    return {{sample.bearings.begin(), sample.bearings.end()}, {sample.points.begin(), sample.points.end()}};
  };
  const auto solve = [method](const OpengvPoints& input) {
    const opengv::absolute_pose::CentralAbsoluteAdapter adapter(input.bearings, input.points);
    return method(adapter);
  };
  const auto read = [](const opengv::transformations_t& maps_from_camera) {
    std::vector<Rigid3> poses;
    for (const auto& m : maps_from_camera) {
      poses.push_back(Rigid3(Eigen::Matrix3d(m.leftCols<3>()), m.col(3)).inverse());
    }
    return poses;
  };
  return peer_solver<PoseProblem, Rigid3>(name, convert, solve, read);
}

#endif

#ifdef MONO_POSE_TRACKER_WITH_POSELIB

inline Rigid3 from_poselib(const poselib::CameraPose& pose) { return {Eigen::Matrix3d(pose.R()), pose.t}; }

struct PoselibVectors {
  std::vector<Eigen::Vector3d> first, second;
};

inline EpipolarSolver<5> poselib_five_point() {
  const auto convert = [](const BearingSample<5>& sample) -> PoselibVectors {
    return {{sample.bearings1.begin(), sample.bearings1.end()},
            {sample.bearings2.begin(), sample.bearings2.end()}};
  };
  const auto solve = [](const PoselibVectors& input) {
    poselib::CameraPoseVector poses;
    poselib::relpose_5pt(input.first, input.second, &poses);
    return poses;
  };
  const auto read = [](const poselib::CameraPoseVector& poses) {
    std::vector<Eigen::Matrix3d> matrices;
    for (const poselib::CameraPose& pose : poses) matrices.push_back(essential_matrix(from_poselib(pose)));
    return matrices;
  };
  return peer_solver<BearingSample<5>, Eigen::Matrix3d>("poselib", convert, solve, read);
}

inline PoseSolver poselib_p3p() {
  const auto convert = [](const PoseProblem& problem) -> PoselibVectors {
    return {{problem.bearings.begin(), problem.bearings.end()},
            {problem.points.begin(), problem.points.end()}};
  };
  const auto solve = [](const PoselibVectors& input) {
    poselib::CameraPoseVector poses;
    poselib::p3p(input.first, input.second, &poses);
    return poses;
  };
  const auto read = [](const poselib::CameraPoseVector& poses) {
    std::vector<Rigid3> read_poses;
    for (const poselib::CameraPose& pose : poses) read_poses.push_back(from_poselib(pose));
    return read_poses;
  };
  return peer_solver<PoseProblem, Rigid3>("poselib", convert, solve, read);
}

#endif

inline std::vector<EpipolarSolver<5>> five_point_solvers() {
  std::vector<EpipolarSolver<5>> solvers;
  solvers.push_back(own_solver<BearingSample<5>, Eigen::Matrix3d, Eigen::Matrix3d, 10>(
      "ours", [](const auto& s, auto* found) { return five_point(s.bearings1, s.bearings2, found); },
      [](const Eigen::Matrix3d& m) { return m; }));
#ifdef MONO_POSE_TRACKER_WITH_POSELIB
  solvers.push_back(poselib_five_point());
#endif
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  namespace relative = opengv::relative_pose;
  solvers.push_back(opengv_epipolar_solver<5>("opengv_stewenius",
                                              [](const auto& a) { return relative::fivept_stewenius(a); }));
  solvers.push_back(
      opengv_epipolar_solver<5>("opengv_nister", [](const auto& a) { return relative::fivept_nister(a); }));
#endif
  const auto find = [](const ImagePoints& p) {
    std::vector<Eigen::Matrix3d> matrices =
        split_stack(cv::findEssentialMat(p.first, p.second, cv::Matx33d::eye()));
    return matrices;
  };
  solvers.push_back(peer_solver<BearingSample<5>, Eigen::Matrix3d>("opencv", to_opencv<5>, find,
                                                                   [](const auto& found) { return found; }));
  return solvers;
}

constexpr double kInFront = 1e-6;  // radians that a ray may be behind by; there is no noise

/// five_point as RANSAC calls it: motions that have the points in front.
inline EpipolarSolver<5> five_point_motions() {
  return own_solver<BearingSample<5>, Eigen::Matrix3d, Motion, 40>(
      "ours_motions",
      [](const auto& s, auto* found) { return five_point(s.bearings1, s.bearings2, kInFront, found); },
      [](const Motion& m) { return essential_matrix(Rigid3(m.rotation, m.translation)); });
}

inline std::vector<EpipolarSolver<7>> seven_point_solvers() {
  std::vector<EpipolarSolver<7>> solvers;
  solvers.push_back(own_solver<BearingSample<7>, Eigen::Matrix3d, Eigen::Matrix3d, 3>(
      "ours", [](const auto& s, auto* found) { return seven_point(s.bearings1, s.bearings2, found); },
      [](const Eigen::Matrix3d& m) { return m; }));
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  solvers.push_back(
      opengv_epipolar_solver<7>("opengv", [](const auto& a) { return opengv::relative_pose::sevenpt(a); }));
#endif
  const auto find = [](const ImagePoints& p) {
    return split_stack(cv::findFundamentalMat(p.first, p.second, cv::FM_7POINT));
  };
  solvers.push_back(peer_solver<BearingSample<7>, Eigen::Matrix3d>("opencv", to_opencv<7>, find,
                                                                   [](const auto& found) { return found; }));
  return solvers;
}

struct OpencvPoints {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> image;
};
struct OpencvPoses {
  std::vector<cv::Vec3d> rotations, translations;
  std::size_t size() const { return rotations.size(); }
};

inline PoseSolver opencv_pose_solver(const std::string& name, int method) {
  const auto convert = [](const PoseProblem& sample) {
    OpencvPoints input;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d& x = sample.points[i];
      const Eigen::Vector2d u = sample.bearings[i].hnormalized();
      input.points.emplace_back(x.x(), x.y(), x.z());
      input.image.emplace_back(u.x(), u.y());
    }
    return input;
  };
  const auto solve = [method](const OpencvPoints& input) {
    OpencvPoses poses;
    cv::solveP3P(input.points, input.image, cv::Matx33d::eye(), cv::noArray(), poses.rotations,
                 poses.translations, method);
    return poses;
  };
  const auto read = [](const OpencvPoses& found) {
    std::vector<Rigid3> poses;
    for (std::size_t i = 0; i < found.size(); ++i) {
      cv::Matx33d rotation;
      cv::Rodrigues(found.rotations[i], rotation);
      Eigen::Matrix3d r;
      cv::cv2eigen(rotation, r);
      const cv::Vec3d& t = found.translations[i];
      poses.emplace_back(r, Eigen::Vector3d(t[0], t[1], t[2]));
    }
    return poses;
  };
  return peer_solver<PoseProblem, Rigid3>(name, convert, solve, read);
}

inline std::vector<PoseSolver> p3p_solvers() {
  std::vector<PoseSolver> solvers;
  solvers.push_back(own_solver<PoseProblem, Rigid3, Motion, 4>(
      "ours", [](const auto& s, auto* found) { return p3p(s.bearings, s.points, found); },
      [](const Motion& m) { return Rigid3(m.rotation, m.translation); }));
#ifdef MONO_POSE_TRACKER_WITH_POSELIB
  solvers.push_back(poselib_p3p());
#endif
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  namespace absolute = opengv::absolute_pose;
  solvers.push_back(opengv_pose_solver("opengv_kneip", [](const auto& a) { return absolute::p3p_kneip(a); }));
  solvers.push_back(opengv_pose_solver("opengv_gao", [](const auto& a) { return absolute::p3p_gao(a); }));
#endif
  solvers.push_back(opencv_pose_solver("opencv_p3p", cv::SOLVEPNP_P3P));
  solvers.push_back(opencv_pose_solver("opencv_ap3p", cv::SOLVEPNP_AP3P));
  return solvers;
}

}  // namespace mono_pose_tracker
