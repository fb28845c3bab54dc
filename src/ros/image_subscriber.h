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

/// Subscribes to an image topic through image_transport. The transport "compressed" works where its plugin is
/// not installed as well: then the <topic>/compressed images are decoded here.
class ImageSubscriber {
 public:
  using Callback = std::function<void(const sensor_msgs::ImageConstPtr&)>;
  /// Told of an image that does not come to the callback, or that the callback failed at, and why.
  using Refusal = std::function<void(const std_msgs::Header&, Reason, const std::string&)>;

  /// No exception leaves either of them. Throws image_transport::TransportLoadException, naming the
  /// transport, when it can't be had.
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
