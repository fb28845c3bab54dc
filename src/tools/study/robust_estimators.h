#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <string>
#include <vector>

#include "common/rotation.h"
#include "common/toolchain.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "robust/bearing_pairs.h"
#include "robust/point_matches.h"
#include "robust/two_view_refinement.h"
#include "simulation/solver_problems.h"

#ifdef MONO_POSE_TRACKER_WITH_OPENGV
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/sac/Ransac.hpp>
#include <opengv/sac_problems/absolute_pose/AbsolutePoseSacProblem.hpp>
#include <opengv/sac_problems/relative_pose/CentralRelativePoseSacProblem.hpp>
#endif

#ifdef MONO_POSE_TRACKER_WITH_POSELIB
#include <PoseLib/robust.h>
#endif

namespace mono_pose_tracker {

constexpr double kConfidence = 0.999;
constexpr int kMostIterations = 10000;

/// Matches with outliers, in the types of all estimators; the truth is second_from_first or camera_from_map.
struct Matches {
  std::vector<Eigen::Vector3d> bearings1, bearings2;  // of two views
  std::vector<Eigen::Vector3d> points;                // of a map, matched with bearings1
  std::vector<cv::Point2d> image1, image2;            // the bearings' image points in pixels
  std::vector<cv::Point3d> object;
  cv::Matx33d camera;
  Rigid3 truth;
  std::vector<char> is_inlier;
  double threshold_px = 0;
  double threshold = 0;  // the same in radians
};

/// An estimator of the pose that Matches::truth holds; false when it fails.
struct RobustEstimator {
  std::string name;
  std::function<bool(const Matches&, Rigid3*)> estimate;
};

inline bool own_relative_pose(const Matches& matches, Rigid3* pose) {
  RelativePoseOptions options;
  options.ransac.threshold = matches.threshold;
  options.ransac.confidence = kConfidence;
  options.ransac.max_iterations = kMostIterations;
  options.max_hypotheses = 1;
  const RelativePoseReport report = estimate_relative_pose(matches.bearings1, matches.bearings2, options);
  if (!report.success) return false;
  *pose = report.hypotheses[0].second_from_first;
  return true;
}

inline bool own_absolute_pose(const Matches& matches, Rigid3* pose) {
  AbsolutePoseOptions options;
  options.ransac.threshold = matches.threshold;
  options.ransac.confidence = kConfidence;
  options.ransac.max_iterations = kMostIterations;
  const AbsolutePoseReport report = estimate_absolute_pose(matches.bearings1, matches.points, options);
  *pose = report.camera_from_map;
  return report.success;
}

/// Matches of bearings1 with `others` that are inliers in truth.
inline void true_inliers(const Matches& matches, const std::vector<Eigen::Vector3d>& others,
                         std::vector<Eigen::Vector3d>* bearings, std::vector<Eigen::Vector3d>* partners) {
  for (std::size_t i = 0; i < matches.is_inlier.size(); ++i) {
    if (!matches.is_inlier[i]) continue;
    bearings->push_back(matches.bearings1[i]);
    partners->push_back(others[i]);
  }
}

// Radians; no true inlier is beyond it.
constexpr double kNoThreshold = 0.4;
constexpr int kUntilItRests = 50;  // iterations

/// Least squares from the truth over the true inliers: what no estimator can be expected to beat.
inline bool optimal_relative_pose(const Matches& matches, Rigid3* pose) {
  std::vector<Eigen::Vector3d> first, second;
  true_inliers(matches, matches.bearings2, &first, &second);
  Motion motion{matches.truth.rotation_matrix(), matches.truth.translation.normalized()};
  refine_two_views(BearingPairs(first, second, 0), kNoThreshold, kUntilItRests, &motion);
  *pose = Rigid3(motion.rotation, motion.translation);
  return true;
}

inline bool optimal_absolute_pose(const Matches& matches, Rigid3* pose) {
  std::vector<Eigen::Vector3d> bearings, points;
  true_inliers(matches, matches.points, &bearings, &points);
  Motion motion{matches.truth.rotation_matrix(), matches.truth.translation};
  refine_camera_pose(PointMatches(bearings, points, 0), kNoThreshold, kUntilItRests, &motion);
  *pose = Rigid3(motion.rotation, motion.translation);
  return true;
}

inline Rigid3 from_opencv(const cv::Mat& rotation, const cv::Mat& translation) {
  Eigen::Matrix3d r;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, r);
  cv::cv2eigen(translation, t);
  return {r, t};
}

inline RobustEstimator opencv_relative_pose(const std::string& name, int method) {
  return {name, [method](const Matches& matches, Rigid3* pose) {
            cv::Mat mask, rotation, translation;
            const cv::Mat essential =
                cv::findEssentialMat(matches.image1, matches.image2, matches.camera, method, kConfidence,
                                     matches.threshold_px, kMostIterations, mask);
            if (essential.rows != 3) return false;
            cv::recoverPose(essential, matches.image1, matches.image2, matches.camera, rotation, translation,
                            mask);
            *pose = from_opencv(rotation, translation);
            return true;
          }};
}

/// `usac` < 0: RANSAC with P3P.
inline RobustEstimator opencv_absolute_pose(const std::string& name, int usac) {
  return {name, [usac](const Matches& matches, Rigid3* pose) {
            cv::Mat vector, translation, rotation;
            const float threshold = static_cast<float>(matches.threshold_px);
            const bool success =
                cv::solvePnPRansac(matches.object, matches.image1, matches.camera, cv::noArray(), vector,
                                   translation, false, kMostIterations, threshold, kConfidence, cv::noArray(),
                                   usac < 0 ? static_cast<int>(cv::SOLVEPNP_P3P) : usac);
            if (!success) return false;
            cv::Rodrigues(vector, rotation);
            *pose = from_opencv(rotation, translation);
            return true;
          }};
}

#ifdef MONO_POSE_TRACKER_WITH_OPENGV

/// Runs OpenGV's RANSAC on a problem; its models are frames in which the camera's pose is given. The error of
/// a match is 1 - cos of its angle.
template <class Problem>
bool opengv_ransac(const std::shared_ptr<Problem>& problem, double threshold, Rigid3* frame_from_camera) {
  opengv::sac::Ransac<Problem> ransac;
  ransac.sac_model_ = problem;
  ransac.threshold_ = 1 - std::cos(threshold);
  ransac.max_iterations_ = kMostIterations;
  ransac.probability_ = kConfidence;
  if (!ransac.computeModel()) return false;
  opengv::transformation_t model;
  problem->optimizeModelCoefficients(ransac.inliers_, ransac.model_coefficients_, model);
  *frame_from_camera = Rigid3(Eigen::Matrix3d(model.leftCols<3>()), model.col(3));
  return true;
}

inline bool opengv_relative_pose(const Matches& matches, Rigid3* pose) {
  using Problem = opengv::sac_problems::relative_pose::CentralRelativePoseSacProblem;
  const opengv::bearingVectors_t first(matches.bearings1.begin(), matches.bearings1.end());
  const opengv::bearingVectors_t second(matches.bearings2.begin(), matches.bearings2.end());
  opengv::relative_pose::CentralRelativeAdapter adapter(first, second);
  Rigid3 first_from_second;
  // Its error is summed over both views.
  if (!opengv_ransac(std::make_shared<Problem>(adapter, Problem::NISTER, false),
                     std::sqrt(2.0) * matches.threshold, &first_from_second)) {
    return false;
  }
  *pose = first_from_second.inverse();
  return true;
}

inline bool opengv_absolute_pose(const Matches& matches, Rigid3* pose) {
  using Problem = opengv::sac_problems::absolute_pose::AbsolutePoseSacProblem;
  const opengv::bearingVectors_t bearings(matches.bearings1.begin(), matches.bearings1.end());
  const opengv::points_t points(matches.points.begin(), matches.points.end());
  opengv::absolute_pose::CentralAbsoluteAdapter adapter(bearings, points);
  Rigid3 map_from_camera;
  if (!opengv_ransac(std::make_shared<Problem>(adapter, Problem::KNEIP, false), matches.threshold,
                     &map_from_camera)) {
    return false;
  }
  *pose = map_from_camera.inverse();
  return true;
}

#endif

#ifdef MONO_POSE_TRACKER_WITH_POSELIB

inline std::vector<Eigen::Vector2d> to_poselib(const std::vector<cv::Point2d>& image) {
  std::vector<Eigen::Vector2d> points;
  for (const cv::Point2d& p : image) points.emplace_back(p.x, p.y);
  return points;
}

inline poselib::Camera poselib_camera(const Matches& matches) {
  const double centre = matches.camera(0, 2);
  return poselib::Camera("SIMPLE_PINHOLE", {matches.camera(0, 0), centre, centre},
                         static_cast<int>(2 * centre), static_cast<int>(2 * centre));
}

/// Options: poselib::RelativePoseOptions or AbsolutePoseOptions.
template <class Options>
Options poselib_options(const Matches& matches) {
  Options options;
  options.max_error = matches.threshold_px;
  options.ransac.success_prob = kConfidence;
  options.ransac.max_iterations = kMostIterations;
  options.ransac.min_iterations = RansacOptions().min_iterations;
  return options;
}

inline bool poselib_relative_pose(const Matches& matches, Rigid3* pose) {
  const poselib::Camera camera = poselib_camera(matches);
  poselib::CameraPose found;
  std::vector<char> inliers;
  const poselib::RansacStats stats = poselib::estimate_relative_pose(
      to_poselib(matches.image1), to_poselib(matches.image2), camera, camera,
      poselib_options<poselib::RelativePoseOptions>(matches), &found, &inliers);
  *pose = Rigid3(Eigen::Matrix3d(found.R()), found.t);
  return stats.num_inliers > 0;
}

inline bool poselib_absolute_pose(const Matches& matches, Rigid3* pose) {
  poselib::Image image;
  image.camera = poselib_camera(matches);
  std::vector<char> inliers;
  const poselib::RansacStats stats = poselib::estimate_absolute_pose(
      to_poselib(matches.image1), matches.points, poselib_options<poselib::AbsolutePoseOptions>(matches),
      &image, &inliers);
  *pose = Rigid3(Eigen::Matrix3d(image.pose.R()), image.pose.t);
  return stats.num_inliers > 0;
}

#endif

inline std::vector<RobustEstimator> relative_pose_estimators() {
  std::vector<RobustEstimator> estimators = {{"ours", own_relative_pose}, {"optimum", optimal_relative_pose}};
#ifdef MONO_POSE_TRACKER_WITH_POSELIB
  estimators.push_back({"poselib", poselib_relative_pose});
#endif
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  estimators.push_back({"opengv_nister", opengv_relative_pose});
#endif
  estimators.push_back(opencv_relative_pose("opencv_ransac", cv::RANSAC));
#ifdef MONO_POSE_TRACKER_WITH_OPENCV_USAC
  estimators.push_back(opencv_relative_pose("opencv_usac_magsac", cv::USAC_MAGSAC));
  estimators.push_back(opencv_relative_pose("opencv_usac_accurate", cv::USAC_ACCURATE));
#endif
  return estimators;
}

inline std::vector<RobustEstimator> absolute_pose_estimators() {
  std::vector<RobustEstimator> estimators = {{"ours", own_absolute_pose}, {"optimum", optimal_absolute_pose}};
#ifdef MONO_POSE_TRACKER_WITH_POSELIB
  estimators.push_back({"poselib", poselib_absolute_pose});
#endif
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  estimators.push_back({"opengv_kneip", opengv_absolute_pose});
#endif
  estimators.push_back(opencv_absolute_pose("opencv_ransac_p3p", -1));
#ifdef MONO_POSE_TRACKER_WITH_OPENCV_USAC
  estimators.push_back(opencv_absolute_pose("opencv_usac_magsac", cv::USAC_MAGSAC));
#endif
  return estimators;
}

// 1296 px span 45 degrees, the front of the box.
const double kFocalPx = 648 / std::tan(22.5 * kDegree);
constexpr double kNoisePx = 1;
constexpr double kThresholdPx = 2;

inline Eigen::Vector3d disturbed(const Eigen::Vector3d& bearing, double noise_px, Random& random) {
  Eigen::Vector3d pixel = bearing / bearing.z();
  pixel.x() += noise_px / kFocalPx * random.normal();
  pixel.y() += noise_px / kFocalPx * random.normal();
  return pixel.normalized();
}

/// Anywhere in the image.
inline Eigen::Vector3d random_bearing(Random& random) {
  const double half = 648 / kFocalPx;
  return Eigen::Vector3d(random.uniform(-half, half), random.uniform(-half, half), 1).normalized();
}

/// Camera, thresholds and the types of OpenCV.
inline void complete(Matches* matches) {
  const double centre = 648;
  matches->camera = cv::Matx33d(kFocalPx, 0, centre, 0, kFocalPx, centre, 0, 0, 1);
  matches->threshold_px = kThresholdPx;
  matches->threshold = kThresholdPx / kFocalPx;
  const auto project = [centre](const Eigen::Vector3d& b) {
    return cv::Point2d(centre + kFocalPx * b.x() / b.z(), centre + kFocalPx * b.y() / b.z());
  };
  for (const Eigen::Vector3d& b : matches->bearings1) matches->image1.push_back(project(b));
  for (const Eigen::Vector3d& b : matches->bearings2) matches->image2.push_back(project(b));
  for (const Eigen::Vector3d& x : matches->points) matches->object.emplace_back(x.x(), x.y(), x.z());
}

/// What the camera of two views does, and what it looks at.
enum class TwoViewScene {
  kGeneral,  // a box as deep as wide, turned by 10 degrees
  kPlanar,   // a hundredth as deep
  kForward,  // a box as deep as wide at distance 4, neared by 1: each epipolar line passes the image's centre
};

inline TwoViewProblem<1> two_view_problem(TwoViewScene scene, Random& random) {
  TwoViewProblem<1> problem = box_problem<1>(random, scene == TwoViewScene::kPlanar ? 0.01 : 1.0);
  if (scene == TwoViewScene::kForward) {
    problem.second_from_first = Rigid3(Eigen::Quaterniond::Identity(), -Eigen::Vector3d::UnitZ());
    problem.bearings2[0] = (problem.second_from_first * problem.x_in_first[0]).normalized();
  }
  return problem;
}

/// Outliers match a random place of the second image.
inline Matches two_view_matches(TwoViewScene scene, int count, double outlier_ratio, Random& random) {
  Matches matches;
  for (int i = 0; i < count; ++i) {
    const TwoViewProblem<1> problem = two_view_problem(scene, random);
    matches.truth = problem.second_from_first;
    const bool is_outlier = random.uniform() < outlier_ratio;
    matches.is_inlier.push_back(!is_outlier);
    matches.bearings1.push_back(disturbed(problem.bearings1[0], kNoisePx, random));
    matches.bearings2.push_back(is_outlier ? random_bearing(random)
                                           : disturbed(problem.bearings2[0], kNoisePx, random));
  }
  complete(&matches);
  return matches;
}

/// A box seen from a random side; outliers are seen at a random place of the image.
inline Matches pose_matches(double depth_by_width, int count, double outlier_ratio, Random& random) {
  Matches matches;
  const Rigid3 map_from_camera(random_rotation(random), 3 * random_direction(random));
  matches.truth = map_from_camera.inverse();
  for (int i = 0; i < count; ++i) {
    const auto problem = box_problem<1>(random, depth_by_width);
    const bool is_outlier = random.uniform() < outlier_ratio;
    matches.is_inlier.push_back(!is_outlier);
    matches.points.push_back(map_from_camera * problem.x_in_first[0]);
    matches.bearings1.push_back(is_outlier ? random_bearing(random)
                                           : disturbed(problem.bearings1[0], kNoisePx, random));
  }
  complete(&matches);
  return matches;
}

}  // namespace mono_pose_tracker
