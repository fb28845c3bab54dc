#pragma once

#include <sensor_msgs/Image.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "mono_pose_tracker/ros/camera_source.h"
#include "mono_pose_tracker/ros/image_conversion.h"
#include "mono_pose_tracker/ros/mask_source.h"
#include "mono_pose_tracker/tracking/tracker.h"

namespace mono_pose_tracker {

/// What a map drawn now would be drawn from.
struct MapView {
  std::shared_ptr<const MapSnapshot> snapshot;
  CameraModel camera;
};

/// Names a state of the map: differs from an earlier one when the map has changed.
struct MapVersion {
  std::uint32_t camera = 0;  // counts trackers: one for each calibration
  std::uint64_t revision = 0;
  bool operator==(const MapVersion& o) const { return camera == o.camera && revision == o.revision; }
};

/// A Tracker fed with ROS messages: converts image, calibration and mask, and starts anew when the
/// calibration changes. Used by the processing thread alone, but for map_version and map_view.
class LiveTracker {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// mask_wanted: whether to wait for a mask. warn: what a user should hear.
  LiveTracker(const TrackerOptions& options, CameraSource& cameras, MaskSource& masks,
              std::chrono::milliseconds mask_timeout, std::function<bool()> mask_wanted, Warn warn);

  /// Never throws: what went wrong is in the report. The converted image, for drawing, is kept until the next
  /// call.
  FrameReport process(const sensor_msgs::ImageConstPtr& message);
  const cv::Mat& image() const { return image_.image; }

  void reset();
  void set_options(const TrackerOptions& options);  // Tracker::set_options

  MapVersion map_version() const;
  std::optional<MapView> map_view() const;  // nothing before the first calibration

 private:
  FrameReport track(const sensor_msgs::ImageConstPtr& message);
  FrameReport refuse(Reason reason, const std::string& text) const;
  void use_camera(const CameraParameters& parameters);
  ConvertedImage mask_for(const sensor_msgs::Image& message);

  TrackerOptions options_;
  CameraSource& cameras_;
  MaskSource& masks_;
  const std::chrono::milliseconds mask_timeout_;
  const std::function<bool()> mask_wanted_;
  const Warn warn_;

  ConvertedImage image_;
  bool first_image_ = true;
  State state_ = State::kWaitingForCameraInfo;
  std::uint32_t epoch_ = 0;       // last reported
  std::uint32_t epoch_base_ = 0;  // added to the present tracker's own: epochs grow across calibrations

  mutable std::mutex mutex_;  // guards the pointer and the count (a Tracker locks for itself)
  std::shared_ptr<Tracker> tracker_;
  CameraModel camera_;
  std::uint32_t trackers_ = 0;
};

}  // namespace mono_pose_tracker
