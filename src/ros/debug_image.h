#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/object_axes.h"

namespace mono_pose_tracker {

/// What a user can do about a reason, a few words in the imperative; empty where there is nothing to do.
const char* what_to_do(Reason reason);

/// The image with its features (green: inliers, with tails to where they were in the last images drawn; red:
/// outliers; blue: unmatched), the motion since the reference image while there is no map (yellow), and in
/// words what became of the image and what the tracker waits for. What is not the object is dimmed, and its
/// outline drawn.
class DebugImage {
 public:
  /// Whether this image is to be drawn: each one, or, while there is no time for that (load_level), one a
  /// second of their stamps: a picture that stands still would be taken for the tracker's.
  bool is_due(const FrameReport& report) const;

  /// image: CV_8UC1 or CV_8UC3 (BGR). object: the axes of one that is posed, drawn red, green, blue; it then
  /// has an outline without a mask, too, round the inliers. Returns CV_8UC3 (BGR) of the same size.
  cv::Mat draw(const cv::Mat& image, const FrameReport& report,
               const std::optional<ObjectAxes>& object = std::nullopt);

 private:
  using Tail = std::deque<cv::Point2f>;  // px, the newest last

  void grow_tails(const FrameReport& report);
  void draw_tails(cv::Mat& canvas) const;

  std::uint32_t epoch_ = 0;                                           // of the tails
  std::int64_t drawn_ns_ = std::numeric_limits<std::int64_t>::min();  // stamp of the last one drawn
  std::map<std::int64_t, Tail> tails_;
};

}  // namespace mono_pose_tracker
