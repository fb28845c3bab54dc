#include "ros/mask_source.h"

#include <algorithm>

namespace mono_pose_tracker {

void MaskSource::put(const sensor_msgs::ImageConstPtr& mask) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    masks_.push_back(mask);
    if (masks_.size() > kCapacity) masks_.pop_front();
  }
  arrived_.notify_all();
}

sensor_msgs::ImageConstPtr MaskSource::wait(const ros::Time& stamp, std::chrono::milliseconds timeout) {
  sensor_msgs::ImageConstPtr found;
  std::unique_lock<std::mutex> lock(mutex_);
  arrived_.wait_for(lock, timeout, [&] {
    const auto it = std::find_if(masks_.begin(), masks_.end(), [&](const sensor_msgs::ImageConstPtr& mask) {
      return mask->header.stamp == stamp;
    });
    if (it != masks_.end()) found = *it;
    return cancelled_ || found != nullptr;
  });
  return found;
}

void MaskSource::cancel() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cancelled_ = true;
  }
  arrived_.notify_all();
}

}  // namespace mono_pose_tracker
