#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/opencv_version.h"
#include "frame_stamps.h"
#include "io/image_decoding.h"
#include "io/image_source.h"
#include "io/video_file.h"
#include "mp4_boxes.h"

namespace mono_pose_tracker {
namespace {

class VideoFile : public ImageSource {
 public:
  explicit VideoFile(const std::string& path) : path_(path) {
    std::error_code ignored;
    if (path.find("://") != std::string::npos || std::filesystem::is_character_file(path, ignored)) {
      throw std::runtime_error(
          path +
          ": is a stream or device, but a recording is read more than once: expected a video file (ffmpeg -i "
          "INPUT -c copy FILE records one). For live tracking use camera.launch device:=" +
          path);
    }
    if (!std::filesystem::is_regular_file(path, ignored)) {
      throw std::runtime_error(path + ": does not exist or is not a regular file: expected a video");
    }
    if (!open_quietly(path))
      throw std::runtime_error(path + ": cannot be opened as a video: expected a format that OpenCV reads");
    frames_per_second_ = capture_.get(cv::CAP_PROP_FPS);
    // Below one frame in a quarter of an hour it is no rate, and stamps would overflow one day.
    if (!(frames_per_second_ > 0.001) || !std::isfinite(frames_per_second_)) {
      throw std::runtime_error(path +
                               ": has no frame rate: expected a video with a frame rate in its header");
    }
    stamps_.emplace(frames_per_second_);
  }

  SourceImage next() override {
    cv::Mat frame;
    if (!capture_.read(frame) || frame.empty()) return end();
    SourceImage result;
    std::ostringstream name;
    name << std::setw(6) << std::setfill('0') << index_++;
    result.mask_name = name.str();
    result.name = result.mask_name + ".png";
    result.stamp_ns = stamps_->next(capture_.get(cv::CAP_PROP_POS_MSEC));
    // A copy: the capture reuses its buffer for the next frame.
    DecodedImage decoded = to_8_bit(frame.clone());
    result.image = decoded.image;
    result.kind = decoded.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    if (!decoded.problem.empty()) {
      result.problem = path_ + ": frame " + result.mask_name + " " + decoded.problem;
    }
    return result;
  }

  bool skip() override {
    if (!capture_.grab()) return false;
    stamps_->next(capture_.get(cv::CAP_PROP_POS_MSEC));
    ++index_;
    return true;
  }

  double pixel_aspect() const override {
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 2)
    const double wide = capture_.get(cv::CAP_PROP_SAR_NUM), high = capture_.get(cv::CAP_PROP_SAR_DEN);
    if (wide > 0 && high > 0 && std::isfinite(wide / high)) return wide / high;
#endif
    return 1;
  }

  int size() const override {
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    return count > 0 && count < 1e9 ? static_cast<int>(count) : -1;  // streams give nonsense or nothing
  }

 private:
  /// Once before the end, what is missing.
  SourceImage end() {
    std::string problem = is_trimmed_mp4(path_) ? "" : problem_of_end(index_, size());
    if (stamps_->out_of_order() > 0) {
      problem += (problem.empty() ? "" : "; ") + std::to_string(stamps_->out_of_order()) +
                 " frames have container time stamps that do not increase: their stamps are computed from "
                 "the frame rate";
    }
    SourceImage result;
    if (std::exchange(is_end_told_, true) || problem.empty()) return result;
    result.kind = SourceImage::Kind::kSkipped;
    result.problem = path_ + ": " + problem;
    return result;
  }

  /// OpenCV logs each backend that cannot read the file, though the next one may.
  bool open_quietly(const std::string& path) {
    namespace logging = cv::utils::logging;
    const logging::LogLevel level = logging::setLogLevel(logging::LOG_LEVEL_SILENT);
    const bool opened = open_as_recorded(path, &capture_);
    logging::setLogLevel(level);
    return opened;
  }

  std::string path_;
  cv::VideoCapture capture_;
  double frames_per_second_ = 0;
  std::optional<FrameStamps> stamps_;
  std::int64_t index_ = 0;
  bool is_end_told_ = false;
};

}  // namespace

bool open_as_recorded(const std::string& path, cv::VideoCapture* capture) {
  // Those that read files: others of OpenCV's look for cameras on the USB first, and leak what they find.
  const auto backends = {cv::CAP_FFMPEG, cv::CAP_GSTREAMER, cv::CAP_OPENCV_MJPEG};
  if (std::none_of(backends.begin(), backends.end(),
                   [&](int backend) { return capture->open(path, backend); })) {
    return false;
  }
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 5)
  // Earlier ones turn nothing. Where the reader knows of no flags it refuses, and that is fine.
  capture->set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
#endif
  return true;
}

std::string problem_of_end(std::int64_t frames, std::int64_t announced) {
  constexpr double kClearly = 0.98;
  const bool is_early =
      frames + 2 <= announced && static_cast<double>(frames) < kClearly * static_cast<double>(announced);
  if (!is_early) return "";
  return "ends after " + std::to_string(frames) + " of the " + std::to_string(announced) +
         " frames stated in its header: it may be damaged";
}

std::unique_ptr<ImageSource> open_video(const std::string& path) { return std::make_unique<VideoFile>(path); }

}  // namespace mono_pose_tracker
