#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "ros/camera_source.h"
#include "ros/image_slot.h"
#include "ros/live_tracker.h"
#include "ros/mask_source.h"

namespace mono_pose_tracker {

/// Processes images like the nodelet, without a roscore: a slot of one image, a tracking thread, and a
/// mapping thread.
class LivePipeline {
 public:
  using Clock = std::chrono::steady_clock;
  /// Called on the tracking thread after each image tracked; latency: since it was put into the slot.
  using Observer = std::function<void(const FrameReport& report, double frame_ms, double latency_ms)>;

  struct Counts {
    int received = 0, tracked = 0, dropped = 0;
  };

  LivePipeline(const TrackerOptions& options, const CameraParameters& camera, Observer observer);
  ~LivePipeline();
  LivePipeline(const LivePipeline&) = delete;
  LivePipeline& operator=(const LivePipeline&) = delete;

  /// Called by one thread, the camera's. Never waits for the tracker.
  /// due_ns: when a camera would have sent the image, at its own rate. Without it there is no time limit: no
  /// work is skipped, and the image is done when it has also been mapped.
  void put(const sensor_msgs::ImageConstPtr& image, std::optional<std::int64_t> due_ns = std::nullopt);
  /// Returns when every image has been tracked or dropped.
  void wait();
  Counts counts() const;
  /// All frames registered in the present map, with the map after the mapper has finished. To be called after
  /// wait().
  std::vector<RegisteredFrame> trajectory_on_final_map();

 private:
  struct Frame {
    sensor_msgs::ImageConstPtr image;
    Clock::time_point arrival;
    bool in_time = true;  // or when all is done
  };

  void run();

  CameraSource cameras_{false};
  MaskSource masks_;
  LiveTracker tracker_;
  const Observer observer_;
  ImageSlot<Frame> slot_;
  mutable std::mutex mutex_;
  std::condition_variable done_;
  Counts counts_;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace mono_pose_tracker
