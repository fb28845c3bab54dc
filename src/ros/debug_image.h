#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// Projection of three axes with a common origin.
struct ObjectAxes {
  Eigen::Vector2d origin_px;
  std::array<Eigen::Vector2d, 3> tips_px;  // of x, y, z
};

/// camera_from_axes: pose of the axes; length: of each. Nothing when one of the four points is behind the
/// camera.
std::optional<ObjectAxes> project_axes(const CameraModel& camera, const Rigid3& camera_from_axes,
                                       double length);

/// Advice for a reason, a few words in the imperative; empty: none.
const char* what_to_do(Reason reason);

/// Draws the features on the image (green: inliers, with tails of their previous positions; red: outliers;
/// blue: unmatched), the motion since the reference image while there is no map (yellow), and a text with the
/// result and what the tracker waits for. Pixels outside the object are dimmed, and its outline is drawn.
class DebugImage {
 public:
  /// Whether this image is to be drawn: every image, or at high load (load_level) one per second by their
  /// stamps, because a frozen picture would look like a frozen tracker.
  bool is_due(const FrameReport& report) const;

  /// image: CV_8UC1 or CV_8UC3 (BGR). object: the axes of a registered object, drawn red, green, blue. Such
  /// an object also gets an outline around its inliers if there is no mask. Returns CV_8UC3 (BGR) of the same
  /// size.
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
