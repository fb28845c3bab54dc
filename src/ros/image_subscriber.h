#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <cstdint>
#include <functional>
#include <string>

#include "io/image_decoding.h"
#include "mono_pose_tracker/common/status.h"

namespace mono_pose_tracker {

/// What to subscribe to.
struct ImageTopic {
  std::string name, transport;
  std::uint64_t max_pixels = kMaxImagePixels;  // of compressed images that are decoded here
};

/// Subscribes to an image topic through image_transport. Without the plugin of the transport "compressed" the
/// images of <topic>/compressed are decoded here.
class ImageSubscriber {
 public:
  using Callback = std::function<void(const sensor_msgs::ImageConstPtr&)>;
  /// Called for an image that could not be delivered, or on which the callback failed, with the reason.
  using Refusal = std::function<void(const std_msgs::Header&, Reason, const std::string&)>;

  /// No exception leaves either callback. Throws image_transport::TransportLoadException, naming the
  /// transport, when it is not available.
  void subscribe(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                 const ImageTopic& source, Callback callback, Refusal refuse);

  /// The resolved name of the topic in fact subscribed to.
  std::string topic() const;
  std::uint32_t publishers() const;

 private:
  image_transport::Subscriber transported_;
  ros::Subscriber compressed_;
};

}  // namespace mono_pose_tracker
