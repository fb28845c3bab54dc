#include "io/undistortion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {

namespace {

/// Moves the image's bounds along one axis, by whole pixels, so that the principal point is in the middle to
/// a quarter of a pixel. Nothing is added, so that no part is blank. A principal point outside stays.
void centre_axis(int* size, double* principal_point) {
  const double before = *principal_point + 0.5, behind = *size - before;  // from the image's edges
  const int centred = static_cast<int>(std::lround(2 * std::min(before, behind)));
  if (centred < 1) return;
  if (before > behind) *principal_point -= *size - centred;
  *size = centred;
}

}  // namespace

Undistorter::Undistorter(const CameraModel& camera) : camera_(camera), undistorted_(camera.parameters()) {
  centre_axis(&undistorted_.width, &undistorted_.cx);
  centre_axis(&undistorted_.height, &undistorted_.cy);
  map_.create(undistorted_.height, undistorted_.width, CV_32FC2);
  undistorted_.distortion_model = "plumb_bob";
  undistorted_.distortion = {0, 0, 0, 0, 0};
  for (int y = 0; y < map_.rows; ++y) {
    for (int x = 0; x < map_.cols; ++x) {
      const Eigen::Vector3d ray((x - undistorted_.cx) / undistorted_.fx,
                                (y - undistorted_.cy) / undistorted_.fy, 1);
      Eigen::Vector2d pixel;
      const bool seen = camera_.project(ray, &pixel);
      map_.at<cv::Vec2f>(y, x) = seen
                                     ? cv::Vec2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()))
                                     : cv::Vec2f(-1e4f, -1e4f);
    }
  }
}

cv::Mat Undistorter::image(const cv::Mat& image) const {
  cv::Mat result;
  cv::remap(image, result, map_, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return result;
}

cv::Mat Undistorter::mask(const cv::Mat& mask) const {
  const cv::Mat all(camera_.height(), camera_.width(), CV_8UC1, cv::Scalar(255));
  cv::Mat result;
  cv::remap(mask.empty() ? all : mask, result, map_, cv::noArray(), cv::INTER_NEAREST, cv::BORDER_CONSTANT);
  return result;
}

Eigen::Vector2d Undistorter::pixel(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d ray = camera_.bearing(pixel);
  if (!ray.allFinite() || ray.z() <= 0) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return {undistorted_.fx * ray.x() / ray.z() + undistorted_.cx,
          undistorted_.fy * ray.y() / ray.z() + undistorted_.cy};
}

}  // namespace mono_pose_tracker
