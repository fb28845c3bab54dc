#include "ros/camera_nodelet.h"

#include <cv_bridge/cv_bridge.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <pluginlib/class_list_macros.hpp>
#include <sstream>
#include <stdexcept>

#include "io/video.h"
#include "ros/camera_info.h"
#include "ros/parameters.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {
namespace {

// No driver keeps an image back for longer; a larger age is that of another clock.
constexpr double kMostAgeSeconds = 2.0;

/// "0" is /dev/video0.
std::string device_path(const std::string& device) {
  const bool is_number = !device.empty() && std::all_of(device.begin(), device.end(),
                                                        [](unsigned char c) { return std::isdigit(c) != 0; });
  return is_number ? "/dev/video" + device : device;
}

int fourcc(const std::string& text) { return cv::VideoWriter::fourcc(text[0], text[1], text[2], text[3]); }

std::string fourcc_text(int code) {
  std::string text;
  for (int i = 0; i < 4; ++i) text += static_cast<char>((code >> (8 * i)) & 0xff);
  return text;
}

}  // namespace

void Capture::open() {
  close();
  is_video() ? open_video() : open_device();
}

void Capture::open_video() {
  const std::string& path = settings_.video;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) throw std::runtime_error("no such video: " + path);
  if (!std::filesystem::is_regular_file(path, ignored))
    throw std::runtime_error(path + " is not a regular file");
  if (!open_as_recorded(path, &capture_)) throw std::runtime_error(path + ": " + cause_of_no_video(path));
  sizes_.emplace(path);
  frames_ = 0;
  const double own = capture_.get(cv::CAP_PROP_FPS);
  rate_ = settings_.rate > 0 ? settings_.rate : own;
  if (!(rate_ >= kSlowestRate) || !std::isfinite(rate_)) {
    close();
    throw std::runtime_error(path + " has no frame rate: set ~rate");
  }
}

void Capture::open_stream() {
  const std::string& url = settings_.device;
  const QuietOpenCv quiet;
  if (!capture_.open(url, cv::CAP_FFMPEG) && !capture_.open(url, cv::CAP_GSTREAMER)) {
    throw std::runtime_error(url +
                             " cannot be opened by OpenCV: it does not respond, or this OpenCV does not "
                             "support this kind of stream; the package video_stream_opencv can publish it");
  }
  rate_ = settings_.rate > 0 ? settings_.rate : capture_.get(cv::CAP_PROP_FPS);
}

void Capture::open_device() {
  if (settings_.device.find("://") != std::string::npos) return open_stream();
  const std::string path = device_path(settings_.device);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw std::runtime_error("no such device: " + path + "; is the camera plugged in?");
  }
  if (access(path.c_str(), R_OK | W_OK) != 0) {
    throw std::runtime_error("no permission to use " + path + ": add your user to the group video");
  }
  if (!capture_.open(path, cv::CAP_V4L2)) {
    throw std::runtime_error(path + " cannot be opened: it is not a camera, or another program uses it");
  }
  // The format first: sizes and rates are those of a format.
  if (!settings_.pixel_format.empty()) capture_.set(cv::CAP_PROP_FOURCC, fourcc(settings_.pixel_format));
  if (settings_.width > 0) capture_.set(cv::CAP_PROP_FRAME_WIDTH, settings_.width);
  if (settings_.height > 0) capture_.set(cv::CAP_PROP_FRAME_HEIGHT, settings_.height);
  if (settings_.rate > 0) capture_.set(cv::CAP_PROP_FPS, settings_.rate);
  rate_ = capture_.get(cv::CAP_PROP_FPS);
}

bool Capture::read_frame(cv::Mat* image) {
  if (is_video() && sizes_->change_by(frames_++)) {
    note_ = sizes_->change();
    return false;
  }
  return capture_.read(*image);
}

Capture::Result Capture::read(cv::Mat* image) {
  bool read = read_frame(image);
  if (!read && is_video() && settings_.loop) {
    open_video();
    read = read_frame(image);
    if (!read) return Result::kFailed;
  }
  if (!read || image->empty()) return is_video() ? Result::kEnd : Result::kFailed;
  return Result::kImage;
}

double Capture::age_seconds() const {
  if (is_video()) return 0;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return age_of_stamp(1e-3 * capture_.get(cv::CAP_PROP_POS_MSEC), std::chrono::duration<double>(now).count());
}

double age_of_stamp(double stamp_seconds, double now_seconds) {
  const double age = now_seconds - stamp_seconds;
  return age > 0 && age < kMostAgeSeconds ? age : 0;
}

std::string Capture::differences() const {
  if (is_video()) return "";
  std::string text;
  const auto add = [&](const std::string& what, const std::string& asked, const std::string& granted) {
    if (asked != granted) text += (text.empty() ? "" : ", ") + what + " " + granted + " instead of " + asked;
  };
  const auto number = [&](int property) { return std::to_string(std::lround(capture_.get(property))); };
  if (settings_.width > 0) add("width", std::to_string(settings_.width), number(cv::CAP_PROP_FRAME_WIDTH));
  if (settings_.height > 0)
    add("height", std::to_string(settings_.height), number(cv::CAP_PROP_FRAME_HEIGHT));
  if (settings_.rate > 0) add("rate", std::to_string(std::lround(settings_.rate)), number(cv::CAP_PROP_FPS));
  if (!settings_.pixel_format.empty()) {
    add("format", settings_.pixel_format, fourcc_text(static_cast<int>(capture_.get(cv::CAP_PROP_FOURCC))));
  }
  return text;
}

namespace {

using diagnostic_msgs::DiagnosticStatus;

// Intervals at which a missing camera is opened again: the first at the start, the second at most.
constexpr std::chrono::milliseconds kFirstRetry{250}, kSlowestRetry{4000};

/// As CameraInfoManager takes it: a path becomes file://PATH, an empty one stays
/// (~/.ros/camera_info/NAME.yaml).
std::string calibration_url(const std::string& url) {
  if (url.empty() || url.find("://") != std::string::npos) return url;
  return "file://" + expand_path(url);
}

std::string size_text(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

}  // namespace

CameraNodelet::~CameraNodelet() { tear_down(); }

void CameraNodelet::tear_down() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  if (capturing_.joinable()) capturing_.join();
  diagnostics_.reset();  // it reads what is destroyed before it
  publisher_ = image_transport::CameraPublisher();
  calibration_.reset();
}

void CameraNodelet::onInit() {
  try {
    read_settings();
    check_video();
    advertise();
    capturing_ = std::thread([this] { capture_images(); });
  } catch (const std::exception& e) {
    NODELET_FATAL("%s", e.what());
    // The loader drops the callback queue before the nodelet: no publisher may outlive it.
    tear_down();
    throw;  // the loader says that the nodelet could not be loaded
  }
}

void CameraNodelet::read_settings() {
  ParameterReader reader(getPrivateNodeHandle());
  reader.read("device", &settings_.device);
  reader.read("video", &settings_.video);
  reader.read("loop", &settings_.loop);
  reader.read("width", &settings_.width, 0, 100000);
  reader.read("height", &settings_.height, 0, 100000);
  reader.read("rate", &settings_.rate, 0.0, 1000.0);
  if (settings_.rate != 0 && settings_.rate < kSlowestRate) {
    std::ostringstream problem;
    problem << "~rate is " << settings_.rate << ", expected 0 (the device's or video's own) or "
            << kSlowestRate << " to 1000 Hz";
    reader.add_problem(problem.str());
  }
  reader.read("pixel_format", &settings_.pixel_format);
  reader.read("frame_id", &frame_id_);
  reader.read("camera_name", &camera_name_);
  reader.read("camera_info_url", &camera_info_url_);
  reader.check("the camera");
  if (!settings_.pixel_format.empty() && settings_.pixel_format.size() != 4) {
    throw std::invalid_argument("~pixel_format is " + settings_.pixel_format +
                                ", expected four letters such as MJPG or YUYV");
  }
  settings_.video = expand_path(settings_.video);
  std::error_code ignored;
  if (settings_.video.empty() && std::filesystem::is_regular_file(device_path(settings_.device), ignored)) {
    throw std::invalid_argument("~device is " + settings_.device +
                                ", which is a file: expected a V4L2 device or the URL of a stream (~video "
                                "plays a video file)");
  }
  for (const std::string& line : reader.unknown("the camera")) NODELET_WARN("%s", line.c_str());
  NODELET_INFO("parameters: %s", reader.effective().c_str());
}

/// Throws if there is a video, and its first image can't be read: unlike a device, no later trial would help.
void CameraNodelet::check_video() const {
  if (settings_.video.empty()) return;
  Capture capture(settings_);
  capture.open();
  cv::Mat image;
  if (capture.read(&image) != Capture::Result::kImage) {
    throw std::runtime_error(settings_.video +
                             ": no image can be read: expected a video that OpenCV decodes");
  }
}

void CameraNodelet::advertise() {
  ros::NodeHandle& handle = getPrivateNodeHandle();
  const std::string url = calibration_url(camera_info_url_);
  calibration_ = std::make_unique<camera_info_manager::CameraInfoManager>(handle, camera_name_, url);
  if (!url.empty() && !calibration_->validateURL(url)) {
    throw std::invalid_argument("~camera_info_url is " + camera_info_url_ +
                                ", expected a path, file:// or package://");
  }
  // Told now: it is read at the first image.
  if (!url.empty()) calibration_file(calibration_->resolveURL(url, camera_name_));
  publisher_ = image_transport::ImageTransport(handle).advertiseCamera("image_raw", 2);
  diagnostics_ = std::make_unique<WallClockUpdater>(
      getNodeHandle(), handle, getName(), settings_.video.empty() ? settings_.device : settings_.video,
      "camera", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
}

void CameraNodelet::capture_images() {
  Capture capture(settings_);
  auto retry = kFirstRetry;
  while (true) {
    bool done = false;
    guarded(
        [&] {
          capture.open();
          const std::string differences = capture.differences();
          if (!differences.empty()) NODELET_WARN("%s: %s", capture.name().c_str(), differences.c_str());
          done = stream(capture);
          if (done) return;
          retry = kFirstRetry;
          set_problem(capture.name() + (capture.is_video() ? " can no longer be read"
                                                           : " delivers no more images; was it unplugged?"));
        },
        [this](const std::string& text) { set_problem(text); });
    if (done || capture.is_video()) return;  // a file that was readable before is damaged or gone for good
    capture.close();
    if (!wait_until(Clock::now() + retry)) return;
    retry = std::min(2 * retry, kSlowestRetry);
  }
}

/// True when there is nothing more to do; false when the device has failed.
bool CameraNodelet::stream(Capture& capture) {
  // A device keeps its own time, a file is read as fast as one likes.
  const auto period =
      capture.is_video()
          ? std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / capture.rate()))
          : Clock::duration::zero();
  Clock::time_point due = Clock::now();
  while (wait_until(due)) {
    cv::Mat image;
    const Capture::Result result = capture.read(&image);
    const std::string note = capture.take_note();
    if (!note.empty() && throttle_.due("video")) NODELET_WARN("%s: %s", capture.name().c_str(), note.c_str());
    if (result == Capture::Result::kFailed) return false;
    if (result == Capture::Result::kEnd) {
      NODELET_INFO("%s has ended", capture.name().c_str());
      const std::lock_guard<std::mutex> lock(mutex_);
      health_.has_ended = true;
      return true;
    }
    publish(image, capture.age_seconds());
    // On a slow machine the video plays slower: no image is skipped.
    due = std::max(due + period, Clock::now() - period);
  }
  return true;
}

void CameraNodelet::publish(const cv::Mat& image, double age_seconds) {
  auto message = boost::make_shared<sensor_msgs::Image>();
  cv_bridge::CvImage bridge({}, "bgr8", image);
  bridge.header.stamp = ros::Time::now();
  // The clock of a simulation may not have come that far yet.
  if (bridge.header.stamp.toSec() > age_seconds) bridge.header.stamp -= ros::Duration(age_seconds);
  bridge.header.frame_id = frame_id_;
  bridge.toImageMsg(*message);
  auto info = boost::make_shared<sensor_msgs::CameraInfo>(calibration_->getCameraInfo());
  info->header = bridge.header;
  if (info->K[0] == 0) {  // not calibrated: what is known is the size
    info->width = static_cast<std::uint32_t>(image.cols);
    info->height = static_cast<std::uint32_t>(image.rows);
  } else if (info->width != message->width || info->height != message->height) {
    if (throttle_.due("calibration size")) {
      NODELET_ERROR("the images are %s, the calibration is for %ux%u: calibrate at the size you use",
                    size_text(image.size()).c_str(), info->width, info->height);
    }
  }
  publisher_.publish(message, info);
  count_image(image.size());
}

void CameraNodelet::count_image(const cv::Size& size) {
  bool is_back;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_back = !health_.problem.empty();
    health_.problem.clear();
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - health_.last_image).count();
    if (is_back) {
      health_.rate = 0;
    } else if (seconds > 0) {
      health_.rate += (health_.rate > 0 ? 0.1 : 1.0) * (1 / seconds - health_.rate);
    }
    health_.last_image = now;
    health_.size = size;
    ++health_.images;
  }
  if (is_back) {
    const std::string& name = settings_.video.empty() ? settings_.device : settings_.video;
    NODELET_INFO("%s delivers images of %s", name.c_str(), size_text(size).c_str());
  }
}

void CameraNodelet::set_problem(const std::string& problem) {
  bool is_new;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_new = health_.problem != problem;
    health_.problem = problem;
    ++health_.failures;
  }
  if (is_new) NODELET_ERROR("%s%s", problem.c_str(), settings_.video.empty() ? " (retrying)" : "");
}

/// False when the nodelet is to stop.
bool CameraNodelet::wait_until(Clock::time_point when) {
  std::unique_lock<std::mutex> lock(mutex_);
  return !stop_.wait_until(lock, when, [this] { return stopping_; });
}

void CameraNodelet::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const bool calibrated = calibration_->isCalibrated();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (health_.has_ended) {
    status.summary(DiagnosticStatus::OK, "the video has ended");
  } else if (!health_.problem.empty()) {
    status.summary(DiagnosticStatus::ERROR, health_.problem);
  } else if (!calibrated) {
    status.summary(DiagnosticStatus::WARN,
                   "images arrive, but the camera is not calibrated: use rosrun camera_calibration "
                   "cameracalibrator.py, or set ~camera_info_url");
  } else {
    status.summary(DiagnosticStatus::OK, "images arrive");
  }
  status.add("source", settings_.video.empty() ? settings_.device : settings_.video);
  status.add("size", size_text(health_.size));
  status.addf("frame rate (Hz)", "%.1f", health_.rate);
  status.add("images", health_.images);
  status.add("failures", health_.failures);
  status.add("calibrated", calibrated);
}

}  // namespace mono_pose_tracker

PLUGINLIB_EXPORT_CLASS(mono_pose_tracker::CameraNodelet, nodelet::Nodelet)
