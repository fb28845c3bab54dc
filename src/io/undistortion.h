#pragma once

#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Images as a pinhole camera without distortion sees them: same focal lengths, cropped by whole pixels so
/// that the principal point is in the middle. Several trainers of Gaussian splats assume that it is.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);

  const CameraParameters& camera() const { return undistorted_; }

  /// Bilinear; black where the camera sees nothing.
  cv::Mat image(const cv::Mat& image) const;
  /// CV_8UC1, 0 stays 0; 0 where the camera sees nothing. An empty mask means all of the image.
  cv::Mat mask(const cv::Mat& mask) const;
  /// Of a pixel of the camera; NaN when it has none.
  Eigen::Vector2d pixel(const Eigen::Vector2d& pixel) const;

 private:
  CameraModel camera_;
  CameraParameters undistorted_;
  cv::Mat map_;  // CV_32FC2: the camera's pixel of each undistorted one
};

}  // namespace mono_pose_tracker
