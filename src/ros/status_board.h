#pragma once

#include <mono_pose_tracker/TrackerStatus.h>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include "camera/camera_parameters.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// Counts images and publishes one ~status for each. May be called from any thread.
class StatusBoard {
 public:
  using Clock = std::chrono::steady_clock;

  /// rectification: part of every status.
  explicit StatusBoard(ros::NodeHandle private_handle, Rectification rectification = {});

  /// To be called for each image as it arrives.
  void count_received();

  /// The answer to a processed image.
  void publish(const std_msgs::Header& header, const FrameReport& report, Clock::time_point arrival);

  /// Publishes the status of an image that was not processed; the state is unchanged.
  void publish_unprocessed(const std_msgs::Header& header, Reason reason, const std::string& text,
                           Clock::time_point arrival);

  /// Sets the state reported for the next unprocessed images, after a command has changed it.
  void note(State state, std::uint32_t epoch);

  struct Summary {
    TrackerStatus last;              // of a processed image; counts of all
    Clock::time_point last_arrival;  // of an image; the construction before the first
    double frames_per_second = 0;    // of arrivals, smoothed over about ten
  };
  Summary summary() const;

 private:
  void publish_locked(TrackerStatus status, const std_msgs::Header& header, Clock::time_point arrival);

  const Rectification rectification_;
  ros::Publisher publisher_;
  mutable std::mutex mutex_;  // guards what follows; statuses leave in the order of their counts
  std::uint32_t received_ = 0, registered_ = 0, dropped_ = 0;
  State state_ = State::kWaitingForCameraInfo;  // of the last image processed
  Summary summary_;
};

}  // namespace mono_pose_tracker
