#pragma once

#include <sensor_msgs/Image.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "mono_pose_tracker/tracking/tracker.h"
#include "ros/camera_source.h"
#include "ros/drawn_map.h"
#include "ros/image_conversion.h"
#include "ros/mask_source.h"
#include "tracking/frame_period.h"
#include "tracking/load_governor.h"

namespace mono_pose_tracker {

/// What a map drawn now would be drawn from.
struct MapView {
  std::uint32_t epoch = 0;  // as the reports count them
  std::shared_ptr<const DrawnMap> map;
  CameraModel camera;
};

/// Names a state of the map: differs from an earlier one when the map has changed.
struct MapVersion {
  std::uint32_t camera = 0;  // counts trackers: one for each calibration
  std::uint64_t revision = 0;
  bool operator==(const MapVersion& o) const { return camera == o.camera && revision == o.revision; }
};

/// A Tracker fed with ROS messages: converts image, calibration and mask, and starts anew when the
/// calibration changes. Used by the processing thread alone, but for note_arrival, cancel, map_version and
/// map_view.
class LiveTracker {
 public:
  /// subject: what the text is about, which may be said again and again; empty: an event (LogThrottle).
  using Warn = std::function<void(const std::string& subject, const std::string& text)>;
  using Clock = std::chrono::steady_clock;

  /// mask_wanted: whether to wait for a mask. warn: what a user should hear. levels: of images of 16 bits.
  LiveTracker(const TrackerOptions& options, CameraSource& cameras, MaskSource& masks,
              std::chrono::milliseconds mask_timeout, std::function<bool()> mask_wanted, Warn warn,
              const GreyLevelChoice& levels = GreyLevelChoice());

  /// An image came, whether it will be processed or dropped. Where those processed take longer than the time
  /// between two that come, less is done for the next ones (LoadGovernor). May be called from any thread.
  void note_arrival(std::int64_t stamp_ns, Clock::time_point arrival);

  /// Never throws: what went wrong is in the report. The converted image, for drawing, is kept until the next
  /// call. arrival: when the message came.
  FrameReport process(const sensor_msgs::ImageConstPtr& message, Clock::time_point arrival = Clock::now());
  const cv::Mat& image() const { return image_.image; }
  /// Of the last calibration that was used.
  const CameraModel& camera() const { return camera_; }

  /// Drops the map; the epoch grows by one when there was a tracker to have one.
  void reset();
  /// Another recording begins. Maps that are only localised in are kept, as are those that wait for a
  /// calibration; others are dropped, as by reset: false.
  bool restart();
  /// As Tracker::set_options; on options out of range, which it throws at, those before stay in force.
  void set_options(const TrackerOptions& options);
  State state() const { return state_; }
  std::uint32_t epoch() const { return epoch_; }
  /// As it is now: it may change while it runs.
  bool localizes_only() const { return options_.localize_only; }

  /// Throws std::runtime_error while there is no map.
  SavedMaps copy_maps();
  /// What the features of maps must have to be loaded (descriptor_kind).
  std::string descriptor() const { return descriptor_kind(options_); }
  /// Goes on in these maps, in a new epoch; before the first calibration: as soon as that comes. False then.
  bool load_maps(SavedMaps saved);

  /// As Tracker::transform_map.
  void transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Tracker::cancel, also of a tracker that is begun later; no mask is waited for any more. May be called
  /// from any thread.
  void cancel();
  /// As Tracker::trajectory; nothing before the first calibration.
  std::vector<RegisteredFrame> trajectory() const;
  /// Returns when the mapper has nothing left to do.
  void wait_for_mapping();

  MapVersion map_version() const;
  std::optional<MapView> map_view() const;  // nothing before the first calibration

 private:
  void govern(Clock::time_point arrival);
  FrameReport track(const sensor_msgs::ImageConstPtr& message);
  FrameReport refuse(Reason reason, const std::string& text) const;
  void remember(const FrameReport& report);
  void go_on_as(State state);
  void load_waiting_maps();
  bool is_present_camera(const CameraParameters& parameters) const;
  void use_camera(const CameraParameters& parameters);
  ConvertedImage mask_for(const sensor_msgs::Image& message);

  TrackerOptions options_;
  CameraSource& cameras_;
  MaskSource& masks_;
  const std::chrono::milliseconds mask_timeout_;
  const std::function<bool()> mask_wanted_;
  const Warn warn_;

  GreyLevelChoice levels_;
  FramePeriod period_;  // guards itself
  LoadGovernor governor_;
  ConvertedImage image_;
  std::optional<SavedMaps> waiting_maps_;  // for the first calibration
  bool first_image_ = true;
  bool has_tracked_ = false;  // posed an image, with this tracker and its maps
  State state_ = State::kWaitingForCameraInfo;
  std::uint32_t epoch_ = 0;                                    // last reported
  FrameReport of_map_;                                         // what was last reported of the map alone
  CalibrationSource calibration_ = CalibrationSource::kGiven;  // of the present tracker

  mutable std::mutex mutex_;      // guards what follows (a Tracker locks for itself)
  std::uint32_t epoch_base_ = 0;  // added to the present tracker's own: epochs grow across calibrations
  std::shared_ptr<Tracker> tracker_;
  CameraModel camera_;
  std::uint32_t trackers_ = 0;
  bool cancelled_ = false;
};

}  // namespace mono_pose_tracker
