#include "mono_pose_tracker/ros/image_subscriber.h"

#include <utility>

#include "mono_pose_tracker/ros/image_conversion.h"

namespace mono_pose_tracker {
namespace {

// Images that may wait for their turn on the nodelet's queue: one that roscpp throws away gets no status. The
// callback only moves a pointer, so that more than one waits only when the machine stalls: some seconds'
// worth.
constexpr int kQueueSize = 100;

bool has_transport(const image_transport::ImageTransport& transports, const std::string& transport) {
  for (const std::string& name : transports.getLoadableTransports()) {
    if (name == "image_transport/" + transport) return true;
  }
  return false;
}

}  // namespace

void ImageSubscriber::subscribe(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                                const std::string& topic, const std::string& transport, Callback callback) {
  image_transport::ImageTransport transports(handle);
  const ros::TransportHints tcp = ros::TransportHints().tcpNoDelay();
  if (transport == "compressed" && !has_transport(transports, transport)) {
    ros::NodeHandle own_handle(handle);
    compressed_ = own_handle.subscribe<sensor_msgs::CompressedImage>(
        handle.resolveName(topic) + "/compressed", kQueueSize,
        [callback = std::move(callback)](const sensor_msgs::CompressedImageConstPtr& message) {
          callback(decode_image(*message));
        },
        ros::VoidConstPtr(), tcp);
    return;
  }
  transported_ = transports.subscribe(
      topic, kQueueSize,
      [callback = std::move(callback)](const sensor_msgs::ImageConstPtr& m) { callback(m); }, ros::VoidPtr(),
      image_transport::TransportHints(transport, tcp, private_handle));
}

std::string ImageSubscriber::topic() const {
  return compressed_ ? compressed_.getTopic() : transported_.getTopic();
}

std::uint32_t ImageSubscriber::publishers() const {
  return compressed_ ? compressed_.getNumPublishers() : transported_.getNumPublishers();
}

}  // namespace mono_pose_tracker
