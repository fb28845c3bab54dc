#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <string>
#include <vector>

#ifdef MONO_POSE_TRACKER_WITH_OPENGV
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/sac/Ransac.hpp>
#include <opengv/sac_problems/absolute_pose/AbsolutePoseSacProblem.hpp>
#include <opengv/sac_problems/relative_pose/CentralRelativePoseSacProblem.hpp>
#endif

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "mono_pose_tracker/robust/relative_pose.h"

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

inline std::vector<RobustEstimator> relative_pose_estimators() {
  std::vector<RobustEstimator> estimators = {{"ours", own_relative_pose}};
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  estimators.push_back({"opengv_nister", opengv_relative_pose});
#endif
  estimators.push_back(opencv_relative_pose("opencv_ransac", cv::RANSAC));
  estimators.push_back(opencv_relative_pose("opencv_usac_magsac", cv::USAC_MAGSAC));
  estimators.push_back(opencv_relative_pose("opencv_usac_accurate", cv::USAC_ACCURATE));
  return estimators;
}

inline std::vector<RobustEstimator> absolute_pose_estimators() {
  std::vector<RobustEstimator> estimators = {{"ours", own_absolute_pose}};
#ifdef MONO_POSE_TRACKER_WITH_OPENGV
  estimators.push_back({"opengv_kneip", opengv_absolute_pose});
#endif
  estimators.push_back(opencv_absolute_pose("opencv_ransac_p3p", -1));
  estimators.push_back(opencv_absolute_pose("opencv_usac_magsac", cv::USAC_MAGSAC));
  return estimators;
}

}  // namespace mono_pose_tracker
