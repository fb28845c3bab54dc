#include "ros/camera_info.h"

#include <camera_calibration_parsers/parse.h>
#include <image_geometry/pinhole_camera_model.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>

#include "camera/camera_parameters.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "ros/parameters.h"

namespace mono_pose_tracker {
namespace {

constexpr std::uint32_t kMostRows = 1u << 30;  // what a message may promise, as a whole number with a sign

/// The linear camera parameters of the image as sent, by image_geometry's conventions for binning and region
/// of interest. Distortion is not passed to it, because it supports fewer models.
image_geometry::PinholeCameraModel linear_model(sensor_msgs::CameraInfo info) {
  info.distortion_model = "plumb_bob";
  info.D.clear();
  image_geometry::PinholeCameraModel model;
  model.fromCameraInfo(info);
  return model;
}

/// Rejects parameters that the camera model cannot represent, because poses would silently be wrong. Returns
/// a note about ignored ones.
std::string check_matrix(const sensor_msgs::CameraInfo& info, bool rectified) {
  const auto& K = info.K;
  const auto& P = info.P;
  try {
    return require_camera_matrix(
        rectified ? std::array<double, 9>{P[0], P[1], P[2], P[4], P[5], P[6], P[8], P[9], P[10]}
                  : std::array<double, 9>{K[0], K[1], K[2], K[3], K[4], K[5], K[6], K[7], K[8]},
        static_cast<int>(std::min(info.height, kMostRows)));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(rectified ? "P " : "K ") + error.what());
  }
}

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

bool has_region(const sensor_msgs::RegionOfInterest& roi) {
  return roi.width > 0 || roi.height > 0 || roi.x_offset > 0 || roi.y_offset > 0;
}

std::string region_text(const sensor_msgs::RegionOfInterest& roi) {
  return "the region of interest " + size_text(roi.width, roi.height) + " at " +
         std::to_string(roi.x_offset) + ", " + std::to_string(roi.y_offset);
}

/// Drivers that crop often give the size and the matrix of the cropped image.
void require_region_in_image(const sensor_msgs::CameraInfo& info) {
  const auto& roi = info.roi;
  const auto lies_in = [](std::uint64_t offset, std::uint64_t size, std::uint64_t whole) {
    return size > 0 && offset + size <= whole;
  };
  if (!has_region(roi) ||
      (lies_in(roi.x_offset, roi.width, info.width) && lies_in(roi.y_offset, roi.height, info.height))) {
    return;
  }
  const bool is_empty = roi.width == 0 || roi.height == 0;
  throw std::invalid_argument(
      region_text(roi) +
      (is_empty ? " is empty"
                : " exceeds the image size " + size_text(info.width, info.height) + " of camera_info") +
      ": expected width, height, K and P of the whole image, or no region (roi all zero) if they describe "
      "the cropped image");
}

/// Of the image as it is sent.
std::string size_origin(const sensor_msgs::CameraInfo& info) {
  std::string text = "width and height of camera_info";
  const bool is_binned = info.binning_x > 1 || info.binning_y > 1;
  if (has_region(info.roi) || is_binned) text += ", " + size_text(info.width, info.height);
  if (has_region(info.roi)) text += ", " + region_text(info.roi);
  if (is_binned) text += ", binning " + size_text(std::max(info.binning_x, 1u), std::max(info.binning_y, 1u));
  return text;
}

bool has_focal_length(const sensor_msgs::CameraInfo& info, bool rectified) {
  return rectified ? info.P[0] > 0 && info.P[5] > 0 : info.K[0] > 0 && info.K[4] > 0;
}

/// Some drivers fill in K or P alone.
std::string no_focal_length_text(const sensor_msgs::CameraInfo& info, bool rectified) {
  const std::string begin = std::string("the camera is not calibrated: ") + (rectified ? "P" : "K") +
                            " of its camera_info has no focal length";
  if (has_focal_length(info, !rectified)) {
    return begin + (rectified ? ", but K has. Set rectified to false if the images are raw"
                              : ", but P has. Set rectified to true if the images are rectified");
  }
  return begin +
         ". Calibrate it (rosrun camera_calibration cameracalibrator.py), or give a calibration file "
         "(track_sequence: --camera; live: ~camera_info_url)";
}

CameraParameters camera_parameters(const sensor_msgs::CameraInfo& info, bool rectified) {
  const image_geometry::PinholeCameraModel model = linear_model(info);
  CameraParameters parameters;
  const cv::Size size = model.reducedResolution();
  parameters.width = size.width;
  parameters.height = size.height;
  const cv::Matx33d K = rectified ? model.projectionMatrix().get_minor<3, 3>(0, 0) : model.intrinsicMatrix();
  parameters.fx = K(0, 0);
  parameters.fy = K(1, 1);
  parameters.cx = K(0, 2);
  parameters.cy = K(1, 2);
  parameters.distortion_model = rectified ? "" : info.distortion_model;
  if (!rectified) parameters.distortion = info.D;
  return parameters;
}

}  // namespace

ConvertedCamera convert_camera_info(const sensor_msgs::CameraInfo& info, bool rectified) {
  if (!has_focal_length(info, rectified))
    return {{}, Reason::kUncalibrated, no_focal_length_text(info, rectified)};
  try {
    ConvertedCamera camera;
    camera.note = check_matrix(info, rectified);
    require_region_in_image(info);
    camera.size_origin = size_origin(info);
    camera.parameters = CameraModel(camera_parameters(info, rectified)).parameters();  // refuses what is none
    camera.has_distortion = std::any_of(info.D.begin(), info.D.end(), [](double d) { return d != 0; });
    return camera;
  } catch (const std::exception& e) {  // of the model's, or of image_geometry's own checks
    return {{}, Reason::kUncalibrated, std::string("the camera's calibration is invalid: ") + e.what()};
  }
}

sensor_msgs::CameraInfo to_camera_info(const CameraParameters& camera) {
  sensor_msgs::CameraInfo info;
  info.header.frame_id = "camera_optical";
  info.width = camera.width;
  info.height = camera.height;
  info.distortion_model = camera.distortion_model;
  info.D = camera.distortion;
  info.K = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

std::string calibration_file(const std::string& url) {
  std::string path = expand_path(url);
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw std::runtime_error("camera_info_url " + url + ": " + path + " is not a regular file");
  }
  return path;
}

sensor_msgs::CameraInfo load_camera_info(const std::string& url) {
  const std::string path = calibration_file(url);
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error("camera_info_url " + url + ": no such file: " + path);
  }
  if (path.size() > 4 && path.compare(path.size() - 4, 4, ".ini") != 0) {
    require_calibration_keys(path);  // its parser knows no limits, and logs instead of saying what is missing
  }
  sensor_msgs::CameraInfo info;
  std::string name;
  if (!camera_calibration_parsers::readCalibration(path, name, info)) {
    throw std::runtime_error("camera_info_url " + url +
                             ": not a calibration file written by camera_calibration: expected a file whose "
                             "name ends in .yaml, .yml or .ini (ost.txt has the INI format: rename it)");
  }
  return info;
}

void CameraSource::set_file(const sensor_msgs::CameraInfo& info) {
  if (!uses_file_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  file_ = convert_camera_info(info, rectified_);
  file_->size_origin = "width and height of the calibration file";
}

void CameraSource::set_message(const sensor_msgs::CameraInfoConstPtr& info) {
  if (!uses_topic_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  message_ = convert_camera_info(*info, rectified_);
  arrived_.notify_all();
}

void CameraSource::set_image_size(int width, int height) {
  if (hfov_deg_ <= 0) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (guess_ && guess_->parameters.width == width && guess_->parameters.height == height) return;
  guess_.emplace();
  guess_->parameters = guess_camera(width, height, hfov_deg_);
  guess_->source = CalibrationSource::kGuessed;
}

bool CameraSource::has_calibration() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return camera().has_value();
}

bool CameraSource::is_calibrated_by_message() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return has_calibrated_message();
}

bool CameraSource::has_calibrated_message() const { return message_ && message_->reason == Reason::kOk; }

std::optional<ConvertedCamera> CameraSource::camera() const {
  if (has_calibrated_message()) return message_;
  if (file_) return file_;
  return guess_ ? guess_ : message_;
}

std::optional<ConvertedCamera> CameraSource::wait(std::chrono::milliseconds timeout) const {
  std::unique_lock<std::mutex> lock(mutex_);
  arrived_.wait_for(lock, timeout, [this] { return !uses_topic_ || message_.has_value(); });
  return camera();
}

}  // namespace mono_pose_tracker
