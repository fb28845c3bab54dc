#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {

/// OpenCV logs nothing while an object of this class lives: it would log each backend that cannot open a
/// video, though the next one may, and the caller reports the failure in its own words.
class QuietOpenCv {
 public:
  QuietOpenCv() : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(level_); }
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
};

/// The size [px] that a coded frame of a video states in its own parameters: H.264 and H.265 (sequence
/// parameter set in a byte stream with start codes, ITU-T H.264 7.3.2.1 and H.265 7.3.2.2) and JPEG. Empty
/// where it states none, as most frames do.
cv::Size coded_size(const std::vector<unsigned char>& packet);

/// Follows the size of the frames in a video file. OpenCV's decoder shows later frames in the size of the
/// first one: after a change, as where two clips were joined, their pixels are wrong. Used by the thread that
/// decodes, which asks before it uses a frame:
///
///     CodedSizes sizes(path);
///     if (sizes.change_by(index)) end(sizes.change());
class CodedSizes {
 public:
  /// Without a change for files and OpenCV versions (below 4.5) whose coded frames cannot be read.
  explicit CodedSizes(const std::string& path);

  /// Whether this frame may have wrong pixels: the size has changed at a frame up to frames_ahead() after it.
  /// The indices of the calls increase.
  bool change_by(std::int64_t index);

  /// The decoder knows so many coded frames more than it has shown, at most: one in each of its threads, and
  /// those that it reorders.
  static std::int64_t frames_ahead();

  /// One line, with the sizes and the first frame of the new size; empty: no change so far.
  const std::string& change() const { return change_; }

 private:
  cv::VideoCapture packets_;
  std::int64_t count_ = 0;  // packets that were read
  cv::Size first_;
  std::string change_;
};

/// The stamps of a video's frames: frame / fps, until the container's times differ from that by more than
/// half a frame (variable frame rate of a phone); the container's times from then on.
class FrameStamps {
 public:
  explicit FrameStamps(double frames_per_second)
      : fps_(frames_per_second), interval_ns_(static_cast<std::int64_t>(std::llround(1e9 / fps_))) {}

  /// Stamp of the next frame. container_ms: time since the first frame; not positive if the container has
  /// none. Stamps increase strictly.
  std::int64_t next(double container_ms);

  /// Number of frames whose container time did not increase; they continue with the interval of the frames
  /// before.
  int out_of_order() const { return out_of_order_; }

 private:
  const double fps_;
  std::int64_t index_ = 0, last_ns_ = -1, interval_ns_;
  bool is_variable_ = false;
  int out_of_order_ = 0;
};

/// Whether the file is an MP4 or MOV that is whole and has an edit list, which leaves out frames that its
/// index counts: what a trim without encoding anew makes.
bool is_trimmed_mp4(const std::string& path);

/// Whether the file begins as an MP4 or MOV and has no index (box moov), which most programs write at the
/// end: the recording was interrupted, or the file was copied in part.
bool lacks_mp4_index(const std::string& path);

/// Frames will be as the sensor read them: a flag of the file that asks for them to be turned (a phone held
/// upright) is not followed, as the orientation tag of an image is not (image_coding.h). False when OpenCV
/// cannot read the file.
bool open_as_recorded(const std::string& path, cv::VideoCapture* capture);

/// The cause and what is expected, for a file of which open_as_recorded returned false. One line that
/// continues the file's name and a colon.
std::string cause_of_no_video(const std::string& path);

/// What to tell of a video of which so many frames could be read and that announces so many (-1: none): empty
/// unless fewer than min_share of them could, as some containers only estimate how many there are.
std::string problem_of_end(std::int64_t frames, std::int64_t announced, double min_share = 0.98);

}  // namespace mono_pose_tracker
