#include "ros/camera_source.h"

#include "camera/camera_parameters.h"

namespace mono_pose_tracker {

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
