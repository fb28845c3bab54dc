#include "mono_pose_tracker/map/image_features.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace mono_pose_tracker {

namespace {

cv::Vec3b color_at(const cv::Mat& image, const Eigen::Vector2f& pixel) {
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, image.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, image.rows - 1);
  if (image.channels() == 1) {
    const std::uint8_t v = image.at<std::uint8_t>(y, x);
    return {v, v, v};
  }
  const cv::Vec3b bgr = image.at<cv::Vec3b>(y, x);
  return {bgr[2], bgr[1], bgr[0]};
}

// A coarse feature is found less exactly than a fine one, though not in proportion: its blob is also the
// cleaner signal. In units of what a feature of 2 px has, of which the thresholds in px speak.
float localisation_sigma(float scale_px) { return std::sqrt(std::max(scale_px / 2, 0.5f)); }

// The bearing of a feature's pixel and how the pixel depends on it; false when the camera can't tell.
bool undistort(const Eigen::Vector2f& feature_pixel, const CameraModel& camera, Eigen::Vector3d* bearing,
               Eigen::Matrix<double, 2, 3>* jacobian) {
  *bearing = camera.bearing(feature_pixel.cast<double>());
  Eigen::Vector2d pixel;
  if (!bearing->allFinite() || !camera.project(*bearing, &pixel, jacobian)) return false;
  // Undistortion that did not return to its pixel is beyond where the model can be trusted: half a pixel is
  // far above its numerical error and below what matters to a match.
  return (pixel - feature_pixel.cast<double>()).norm() <= 0.5;
}

}  // namespace

ImageFeaturesPtr make_image_features(FeatureSet features, const cv::Mat& image, const CameraModel& camera) {
  auto result = std::make_shared<ImageFeatures>();
  result->camera = camera;
  const int n = features.size();
  result->pixel_from_bearing.reserve(n);
  result->sigma_px.reserve(n);
  result->color_rgb.reserve(n);
  FeatureSet& kept = result->set;
  kept.features.reserve(n);
  kept.bearings.reserve(n);
  kept.descriptors = features.descriptors.empty() ? cv::Mat() : cv::Mat(features.descriptors.size(), CV_8U);
  for (int i = 0; i < n; ++i) {
    const Feature& feature = features.features[i];
    Eigen::Vector3d bearing;
    Eigen::Matrix<double, 2, 3> jacobian;
    if (!undistort(feature.pixel, camera, &bearing, &jacobian)) continue;
    features.descriptors.row(i).copyTo(kept.descriptors.row(kept.size()));
    kept.features.push_back(feature);
    kept.bearings.push_back(bearing);
    result->pixel_from_bearing.push_back(jacobian);
    result->sigma_px.push_back(localisation_sigma(feature.scale));
    result->color_rgb.push_back(color_at(image, feature.pixel));
  }
  if (!kept.descriptors.empty()) kept.descriptors = kept.descriptors.rowRange(0, kept.size());
  result->grid = FeatureGrid(kept, camera.width(), camera.height());
  return result;
}

ImageFeaturesPtr restore_image_features(FeatureSet features, std::vector<cv::Vec3b> color_rgb,
                                        const CameraModel& camera) {
  auto result = std::make_shared<ImageFeatures>();
  result->camera = camera;
  result->set = std::move(features);
  result->color_rgb = std::move(color_rgb);
  for (const Feature& feature : result->set.features) {
    Eigen::Vector3d bearing;
    Eigen::Matrix<double, 2, 3> jacobian;
    if (!feature.pixel.allFinite() || !camera.in_image(feature.pixel.cast<double>()) ||
        !undistort(feature.pixel, camera, &bearing, &jacobian)) {
      throw std::invalid_argument("a feature lies outside the image");
    }
    result->set.bearings.push_back(bearing);
    result->pixel_from_bearing.push_back(jacobian);
    result->sigma_px.push_back(localisation_sigma(feature.scale));
  }
  result->grid = FeatureGrid(result->set, camera.width(), camera.height());
  return result;
}

ImageFeaturesPtr select_features(const ImageFeatures& image, const std::vector<char>& flags) {
  auto result = std::make_shared<ImageFeatures>();
  result->camera = image.camera;
  result->set.descriptors.create(0, image.set.descriptors.cols, image.set.descriptors.type());
  for (int i = 0; i < image.size(); ++i) {
    if (!flags[i]) continue;
    result->set.features.push_back(image.set.features[i]);
    result->set.bearings.push_back(image.set.bearings[i]);
    result->set.descriptors.push_back(image.set.descriptors.row(i));
    result->pixel_from_bearing.push_back(image.pixel_from_bearing[i]);
    result->sigma_px.push_back(image.sigma_px[i]);
    result->color_rgb.push_back(image.color_rgb[i]);
  }
  result->grid = FeatureGrid(result->set, image.camera.width(), image.camera.height());
  return result;
}

}  // namespace mono_pose_tracker
