#pragma once

#include <cstdint>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
