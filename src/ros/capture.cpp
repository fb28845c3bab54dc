#include "ros/capture.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "io/video_file.h"

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
  const double own = capture_.get(cv::CAP_PROP_FPS);
  rate_ = settings_.rate > 0 ? settings_.rate : own;
  if (!(rate_ >= kSlowestRate) || !std::isfinite(rate_)) {
    close();
    throw std::runtime_error(path + " has no frame rate: set ~rate");
  }
}

void Capture::open_stream() {
  const std::string& url = settings_.device;
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

Capture::Result Capture::read(cv::Mat* image) {
  bool read = capture_.read(*image);
  if (!read && is_video() && settings_.loop) {
    open_video();
    read = capture_.read(*image);
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

}  // namespace mono_pose_tracker
