#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// Tracks one camera against the map it builds: bootstraps, resects every frame, hands keyframes to the mapper, which
/// runs inline (repeatable) or on a worker thread of its own.
///
/// Threads: process and reset are called from one thread; snapshot and revision from any.
class Tracker {
 public:
  enum class Mapping { kInline, kThreaded };

  /// Throws std::invalid_argument on options out of range.
  Tracker(const TrackerOptions& options, const CameraModel& camera, Mapping mapping);
  ~Tracker();  // joins the worker
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// image: CV_8UC1 or CV_8UC3 (BGR), of the camera's size. mask: empty, or CV_8UC1 of the same size, 0 = ignore.
  FrameReport process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask = cv::Mat());

  /// Drops the map; the epoch grows by one.
  void reset();

  std::uint64_t revision() const;
  std::shared_ptr<const MapSnapshot> snapshot() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono_pose_tracker
