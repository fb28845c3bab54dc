#pragma once

#include <camera_info_manager/camera_info_manager.h>
#include <image_transport/image_transport.h>
#include <nodelet/nodelet.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "ros/capture.h"
#include "ros/log_throttle.h"
#include "ros/wall_clock_updater.h"

namespace mono_pose_tracker {

/// Publishes a V4L2 camera or a video file as ~image_raw and ~camera_info, for machines without a driver
/// package. A missing or disconnected camera is reported on /diagnostics and opened again. One thread
/// captures; the nodelet's queue answers ~set_camera_info and runs the diagnostics.
class CameraNodelet : public nodelet::Nodelet {
 public:
  ~CameraNodelet() override;

 private:
  using Clock = std::chrono::steady_clock;

  /// State reported on /diagnostics.
  struct Health {
    std::string problem = "not opened yet";  // empty: images come
    bool has_ended = false;                  // the video, which does not loop
    std::uint32_t images = 0, failures = 0;
    double rate = 0;  // Hz, of the images published, smoothed over about ten
    cv::Size size;    // px
    Clock::time_point last_image;
  };

  void onInit() override;
  void read_settings();
  void advertise();
  void tear_down();  // at any stage of its start, and more than once

  void capture_images();
  bool stream(Capture& capture);
  void publish(const cv::Mat& image, double age_seconds);
  void count_image(const cv::Size& size);
  void set_problem(const std::string& problem);
  bool wait_until(Clock::time_point when);

  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  CaptureSettings settings_;
  std::string frame_id_ = "camera", camera_name_ = "camera", camera_info_url_;

  std::unique_ptr<camera_info_manager::CameraInfoManager> calibration_;
  image_transport::CameraPublisher publisher_;
  std::unique_ptr<WallClockUpdater> diagnostics_;
  LogThrottle throttle_{std::chrono::seconds(30)};  // of the capturing thread

  mutable std::mutex mutex_;  // guards stopping_ and health_
  std::condition_variable stop_;
  bool stopping_ = false;
  Health health_;
  std::thread capturing_;  // joined by tear_down
};

}  // namespace mono_pose_tracker
