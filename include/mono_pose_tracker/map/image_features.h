#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/feature_grid.h"
#include "mono_pose_tracker/features/feature_set.h"

namespace mono_pose_tracker {

/// Everything kept of an image: its features, undistorted to unit bearings.
struct ImageFeatures {
  CameraModel camera;  // that took the image: the keyframes of a map may be of several
  FeatureSet set;
  FeatureGrid grid;
  /// d pixel / d bearing at each feature: turns a small error of a bearing into pixels, whatever the
  /// distortion.
  std::vector<Eigen::Matrix<double, 2, 3>> pixel_from_bearing;
  std::vector<float> sigma_px;       // expected localisation error of each feature
  std::vector<cv::Vec3b> color_rgb;  // of the image at each feature

  int size() const { return set.size(); }
};

using ImageFeaturesPtr = std::shared_ptr<const ImageFeatures>;

/// Adds bearings, grid, Jacobians and colours to the features of an image (CV_8UC1 or BGR CV_8UC3). Features
/// outside the range of the camera model are excluded.
ImageFeaturesPtr make_image_features(FeatureSet features, const cv::Mat& image, const CameraModel& camera);

/// From stored features with descriptors and colours. Bearings, Jacobians and grid are recomputed. Throws
/// std::invalid_argument on a feature outside the range of the camera model.
ImageFeaturesPtr restore_image_features(FeatureSet features, std::vector<cv::Vec3b> color_rgb,
                                        const CameraModel& camera);
/// The features with a non-zero flag, in the same order.
ImageFeaturesPtr select_features(const ImageFeatures& image, const std::vector<char>& flags);

/// Reprojection error in px of a point against feature i, to first order in the error; 1e6 px when it is
/// behind.
inline Eigen::Vector2d reprojection_error(const ImageFeatures& image, int i,
                                          const Eigen::Vector3d& x_in_camera) {
  const double along = image.set.bearings[i].dot(x_in_camera);
  if (along <= 1e-12) return Eigen::Vector2d::Constant(1e6);
  return image.pixel_from_bearing[i] * x_in_camera / along;
}

/// The norm of the error in units of the feature's localisation error, which thresholds in px refer to.
inline double weighted_error(const ImageFeatures& image, int i, const Eigen::Vector3d& x_in_camera) {
  return reprojection_error(image, i, x_in_camera).norm() / image.sigma_px[i];
}

}  // namespace mono_pose_tracker
