#pragma once

#include <sensor_msgs/Image.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>

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

}  // namespace mono_pose_tracker
