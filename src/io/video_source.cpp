#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <opencv2/videoio.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "coded_size.h"
#include "common/pixel_hash.h"
#include "common/quiet_opencv.h"
#include "common/toolchain.h"
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
    if (!open_as_recorded(path, &capture_)) throw std::runtime_error(path + ": " + cause_of_no_video(path));
    frames_per_second_ = capture_.get(cv::CAP_PROP_FPS);
    // Below one frame in a quarter of an hour it is no rate, and stamps would overflow one day.
    if (!(frames_per_second_ > 0.001) || !std::isfinite(frames_per_second_)) {
      throw std::runtime_error(path +
                               ": has no frame rate: expected a video with a frame rate in its header");
    }
    stamps_.emplace(frames_per_second_);
    sizes_.emplace(path);
  }

  SourceImage next() override {
    const cv::Mat frame = frame_of_index();
    if (frame.empty()) return end();
    SourceImage result;
    std::ostringstream name;
    name << std::setw(6) << std::setfill('0') << index_;
    result.mask_name = name.str();
    result.name = result.mask_name + ".png";
    result.stamp_ns = known_[static_cast<std::size_t>(index_++)].stamp_ns;
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
    if (!is_known() && frame_of_index().empty()) return false;
    ++index_;
    return true;
  }

  bool rewind() override {
    index_ = 0;
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
  /// A frame that was decoded before. Its content identifies it after a seek, as its time does not: OpenCV
  /// computes that from the frame rate.
  struct KnownFrame {
    std::int64_t stamp_ns = 0;
    std::size_t hash = 0;  // of the pixels
  };

  bool is_known() const { return index_ < static_cast<std::int64_t>(known_.size()); }

  /// The frame with index_, always with the same pixels; empty at the end. Shares the capture's memory.
  cv::Mat frame_of_index() {
    if (!is_known()) {
      if (is_whole_) return {};
      if (has_sought_) open_again();  // times and pixels after a seek are not certain
      const bool is_there = !sizes_->change_by(index_) && go_to_index();
      const cv::Mat frame = is_there ? decode() : cv::Mat();
      is_whole_ = frame.empty();
      if (!is_whole_)
        known_.push_back({stamps_->next(capture_.get(cv::CAP_PROP_POS_MSEC)), pixel_hash(frame)});
      return frame;
    }
    const cv::Mat frame = go_to_index() ? decode() : cv::Mat();
    if (!frame.empty() && pixel_hash(frame) == known_[static_cast<std::size_t>(index_)].hash) return frame;
    is_seekable_ = false;
    open_again();
    return go_to_index() ? decode() : cv::Mat();
  }

  cv::Mat decode() {
    cv::Mat frame;
    if (!capture_.read(frame)) return {};
    ++position_;
    return frame;
  }

  bool go_to_index() {
    if (index_ < position_ || (is_known() && index_ - position_ > kKeyFrameDistance)) seek();
    for (; position_ < index_; ++position_) {
      if (!capture_.grab()) return false;
    }
    return true;
  }

  /// Places the capture at index_ or shortly before it, by a key frame. OpenCV seeks to a time, in units of
  /// the mean frame rate, and not exactly in all containers: the frame that is found is looked up among the
  /// known ones.
  void seek() {
    const std::int64_t most = 8 * kKeyFrameDistance;
    for (std::int64_t before = 1; is_seekable_ && before < std::min(index_, most); before *= 4) {
      const std::int64_t stamp_ns = known_[static_cast<std::size_t>(index_ - before)].stamp_ns;
      const double number = std::round(1e-9 * static_cast<double>(stamp_ns) * frames_per_second_);
      if (!capture_.set(cv::CAP_PROP_POS_FRAMES, number)) break;
      const cv::Mat frame = decode();
      const std::int64_t found = frame.empty() ? -1 : last_before_index(pixel_hash(frame));
      if (found < 0) continue;
      position_ = found + 1;
      has_sought_ = true;
      return;
    }
    open_again();
  }

  /// The last known frame before index_ with these pixels, within reach of a seek; -1: none.
  std::int64_t last_before_index(std::size_t hash) const {
    const std::int64_t first = std::max<std::int64_t>(0, index_ - 16 * kKeyFrameDistance);
    for (std::int64_t i = index_ - 1; i >= first; --i) {
      if (known_[static_cast<std::size_t>(i)].hash == hash) return i;
    }
    return -1;
  }

  void open_again() {
    position_ = 0;
    has_sought_ = false;
    if (!open_as_recorded(path_, &capture_)) throw std::runtime_error(path_ + ": can no longer be opened");
  }

  /// Once before the end, what is missing.
  SourceImage end() {
    std::string problem = sizes_->change();
    if (problem.empty() && !is_trimmed_mp4(path_)) problem = problem_of_end(index_, size());
    if (stamps_->out_of_order() > 0) {
      problem += (problem.empty() ? "" : "; ") + std::to_string(stamps_->out_of_order()) +
                 " frames have container time stamps that do not increase: their stamps continue with the "
                 "interval of the frames before";
    }
    SourceImage result;
    if (std::exchange(is_end_told_, true) || problem.empty()) return result;
    result.kind = SourceImage::Kind::kSkipped;
    result.problem = path_ + ": " + problem;
    return result;
  }

  // Frames: key frames are at most so far apart by the default of x264. Up to there decoding takes no longer
  // than seeking, which decodes from a key frame.
  static constexpr std::int64_t kKeyFrameDistance = 250;

  std::string path_;
  cv::VideoCapture capture_;
  double frames_per_second_ = 0;
  std::optional<FrameStamps> stamps_;
  std::optional<CodedSizes> sizes_;
  std::vector<KnownFrame> known_;  // by index
  bool is_whole_ = false;          // the last known frame is the last of the video
  std::int64_t index_ = 0;         // of the next frame to be given out
  std::int64_t position_ = 0;      // of the next frame that the capture decodes
  bool is_seekable_ = true;
  bool has_sought_ = false;  // since it was opened
  bool is_end_told_ = false;
};

}  // namespace

bool open_as_recorded(const std::string& path, cv::VideoCapture* capture) {
  // Those that read files: others of OpenCV's look for cameras on the USB first, and leak what they find.
  const QuietOpenCv quiet;
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

std::string cause_of_no_video(const std::string& path) {
  if (lacks_mp4_index(path)) {
    return "cannot be opened as a video: its index (moov) is missing, because the recording was interrupted "
           "or the file was copied in part; expected the whole file";
  }
  return "cannot be opened as a video: expected a format that OpenCV reads";
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
