#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>

namespace mono_pose_tracker {

/// Subscribes to an image topic through image_transport. The transport "compressed" works where its plugin is
/// not installed as well: then the <topic>/compressed images are decoded here.
class ImageSubscriber {
 public:
  using Callback = std::function<void(const sensor_msgs::ImageConstPtr&)>;

  /// Throws image_transport::TransportLoadException, naming the transport, when it can't be had.
  void subscribe(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                 const std::string& topic, const std::string& transport, Callback callback);

  /// The resolved name of the topic in fact subscribed to.
  std::string topic() const;
  std::uint32_t publishers() const;

 private:
  image_transport::Subscriber transported_;
  ros::Subscriber compressed_;
};

}  // namespace mono_pose_tracker
