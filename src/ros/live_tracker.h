#pragma once

#include <sensor_msgs/Image.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "mono_pose_tracker/tracking/tracker.h"
#include "ros/camera_info.h"
#include "ros/image_conversion.h"
#include "tracking/load_governor.h"
#include "tracking/map_snapshot.h"

namespace mono_pose_tracker {

/// Keeps the newest masks until the images with their stamps are processed. May be called from any thread.
class MaskSource {
 public:
  void put(const sensor_msgs::ImageConstPtr& mask);

  /// The mask with this stamp; waits for it at most this long. Null when there is none.
  sensor_msgs::ImageConstPtr wait(const ros::Time& stamp, std::chrono::milliseconds timeout);

  /// Ends all waiting, now and later.
  void cancel();

 private:
  // Masks that may wait for their images: a segmentation runs a few images ahead of the tracker at most.
  static constexpr std::size_t kCapacity = 30;

  std::mutex mutex_;  // guards what follows
  std::condition_variable arrived_;
  std::deque<sensor_msgs::ImageConstPtr> masks_;
  bool cancelled_ = false;
};

/// A copy of the map for drawing, made once and on first use: copying takes time proportional to the size of
/// the map, and often nobody subscribes. May be used from any thread.
class DrawnMap {
 public:
  /// map: null while there is none.
  explicit DrawnMap(TrackingMapPtr map) : map_(std::move(map)), newest_(newest_view_of(map_)) {}

  bool has_points() const { return map_ && !map_->landmarks.empty(); }
  const MapSnapshot& newest() const { return newest_; }
  const MapSnapshot& all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!all_) all_ = snapshot_of(map_);
    return *all_;
  }
  bool is_copied() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return all_ != nullptr;
  }

 private:
  const TrackingMapPtr map_;
  const MapSnapshot newest_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::shared_ptr<const MapSnapshot> all_;
};

/// The data for drawing the present map.
struct MapView {
  std::uint32_t epoch = 0;  // as the reports count them
  std::shared_ptr<const DrawnMap> map;
  CameraModel camera;
};

/// Identifies a state of the map: it differs from an earlier one when the map has changed.
struct MapVersion {
  std::uint32_t camera = 0;  // counts trackers: one for each calibration
  std::uint64_t revision = 0;
  bool operator==(const MapVersion& o) const { return camera == o.camera && revision == o.revision; }
};

/// Runs a Tracker on ROS messages: converts image, calibration and mask, and restarts when the calibration
/// changes. For the processing thread only, except note_arrival, cancel, map_version and map_view.
class LiveTracker {
 public:
  /// subject: topic of a repeatable warning; empty: an event (LogThrottle).
  using Warn = std::function<void(const std::string& subject, const std::string& text)>;
  using Clock = std::chrono::steady_clock;

  /// mask_wanted: whether to wait for a mask. warn: shows a warning to the user. levels: for images of 16
  /// bits.
  LiveTracker(const TrackerOptions& options, CameraSource& cameras, MaskSource& masks,
              std::chrono::milliseconds mask_timeout, std::function<bool()> mask_wanted, Warn warn,
              const GreyLevelChoice& levels = GreyLevelChoice());

  /// Records the arrival of an image, processed or dropped later. If processing takes longer than the time
  /// between arrivals, the work per image is reduced (LoadGovernor). May be called from any thread.
  void note_arrival(std::int64_t stamp_ns, Clock::time_point arrival);

  /// Never throws: errors are in the report. The converted image is kept for drawing until the next call.
  /// arrival: when the message came.
  FrameReport process(const sensor_msgs::ImageConstPtr& message, Clock::time_point arrival = Clock::now());
  const cv::Mat& image() const { return image_.image; }
  /// Of the last calibration that was used.
  const CameraModel& camera() const { return camera_; }

  /// Drops the map; the epoch grows by one if there was a tracker.
  void reset();
  /// Starts another recording. Maps used for localisation only, and maps waiting for a calibration, are kept;
  /// others are dropped as by reset (false).
  bool restart();
  /// As Tracker::set_options; throws on options out of range and keeps the previous ones.
  void set_options(const TrackerOptions& options);
  State state() const { return state_; }
  std::uint32_t epoch() const { return epoch_; }
  /// The present options; they may change at run time.
  bool localizes_only() const { return options_.localize_only; }

  /// Throws std::runtime_error while there is no map.
  SavedMaps copy_maps();
  /// The descriptor kind that loaded maps must have (descriptor_kind).
  std::string descriptor() const { return descriptor_kind(options_); }
  /// Continues in these maps, in a new epoch. Before the first calibration: returns false, and they are used
  /// as soon as it arrives.
  bool load_maps(SavedMaps saved);

  /// As Tracker::transform_map.
  void transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Tracker::cancel, also for trackers created later; waiting for masks ends. May be called from any thread.
  void cancel();
  /// As Tracker::trajectory; nothing before the first calibration.
  std::vector<RegisteredFrame> trajectory() const;
  /// Returns when the mapper has no work left.
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
  /// Of the image's alpha and of the mask topic; empty: everything is used.
  cv::Mat mask_for(const sensor_msgs::Image& message);
  cv::Mat mask_of_topic(const sensor_msgs::Image& message);

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
  bool has_alpha_ = false;    // an image had transparent pixels
  bool has_tracked_ = false;  // registered an image, with this tracker and its maps
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
