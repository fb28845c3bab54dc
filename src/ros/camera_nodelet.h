#pragma once

#include <camera_info_manager/camera_info_manager.h>
#include <image_transport/image_transport.h>
#include <nodelet/nodelet.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "io/video.h"
#include "ros/diagnostics.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {

/// Lowest rate [Hz]: an image in eleven days. At lower rates the interval would overflow the clock.
constexpr double kSlowestRate = 1e-6;

/// What to capture, and how.
struct CaptureSettings {
  std::string device = "/dev/video0";  // V4L2: a path, or the number at the end of it; or the URL of a stream
  std::string video;                   // a video file in the device's place; empty: the device
  bool loop = false;                   // the video, from its beginning again
  int width = 0, height = 0;           // px, asked of the device; 0: its own
  double rate = 0;                     // Hz, not below kSlowestRate; 0: the device's or the video's own
  std::string pixel_format;            // MJPG, YUYV, ...: asked of the device; empty: its own
};

/// Images of a V4L2 device or of a video file. Used by one thread.
class Capture {
 public:
  enum class Result { kImage, kEnd, kFailed };

  explicit Capture(const CaptureSettings& settings) : settings_(settings) {}

  /// Throws std::runtime_error, one line that says what is missing. The device may grant other settings than
  /// requested.
  void open();
  void close() { capture_.release(); }

  /// The next image (CV_8UC3, BGR). Blocks until the device has one; kFailed when it is gone, kEnd at the end
  /// of a video.
  Result read(cv::Mat* image);

  /// Problem of the video that the last images showed, one line; empty: none. It is given once.
  std::string take_note() { return std::exchange(note_, ""); }

  /// Age of the last image [s]; 0 for a video.
  double age_seconds() const;

  /// Frame rate [Hz]; 0 when the device does not report it.
  double rate() const { return rate_; }
  bool is_video() const { return !settings_.video.empty(); }
  const std::string& name() const { return is_video() ? settings_.video : settings_.device; }

  /// Settings that the device granted in place of the requested ones, one line; empty: none differ.
  std::string differences() const;

 private:
  void open_device();
  void open_stream();
  void open_video();
  bool read_frame(cv::Mat* image);

  CaptureSettings settings_;
  cv::VideoCapture capture_;
  double rate_ = 0;
  std::optional<CodedSizes> sizes_;  // of a video
  std::int64_t frames_ = 0;          // of the video since it was opened
  std::string note_;
};

/// Seconds from a driver's stamp (of the monotonic clock, as V4L2 gives it) to now; 0 for stamps of another
/// clock, which show as ages that no image has.
double age_of_stamp(double stamp_seconds, double now_seconds);

/// Publishes a V4L2 camera or a video file as ~image_raw and ~camera_info, for machines without a driver
/// package. A missing or disconnected camera is reported on /diagnostics and opened again; a video file that
/// cannot be read is refused at the start. One thread captures; the nodelet's queue answers ~set_camera_info
/// and runs the diagnostics.
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
  void check_video() const;
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
