#include "segmentation/object_points.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/median.h"

namespace mono_pose_tracker {

cv::Mat1f distances_from(const std::vector<cv::Point2f>& points, const cv::Size& size) {
  cv::Mat1b places(size, 255);
  for (const cv::Point2f& p : points) {
    const cv::Point pixel(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
    if (cv::Rect(cv::Point(), size).contains(pixel)) places(pixel) = 0;
  }
  if (cv::countNonZero(places) == static_cast<int>(places.total())) {
    return cv::Mat1f(size, static_cast<float>(size.width + size.height));
  }
  cv::Mat1f distance;
  cv::distanceTransform(places, distance, cv::DIST_L2, cv::DIST_MASK_5);
  return distance;
}

float reach_of(const std::vector<cv::Point2f>& points) {
  std::vector<double> x, y, away;
  for (const cv::Point2f& p : points) x.push_back(p.x), y.push_back(p.y);
  const double middle_x = median(std::move(x)), middle_y = median(std::move(y));
  for (const cv::Point2f& p : points) away.push_back(std::hypot(p.x - middle_x, p.y - middle_y));
  return static_cast<float>(median(std::move(away)) / 2);
}

}  // namespace mono_pose_tracker
