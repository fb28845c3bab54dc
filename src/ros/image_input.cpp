#include "ros/image_input.h"

#include <utility>

#include "ros/image_conversion.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {
namespace {

// Queue size: images that may wait for their callback; one discarded by roscpp gets no status. The callback
// only moves a pointer, so that several wait only when the machine stalls: enough for some seconds.
constexpr int kQueueSize = 100;

bool has_transport(const image_transport::ImageTransport& transports, const std::string& transport) {
  for (const std::string& name : transports.getLoadableTransports()) {
    if (name == "image_transport/" + transport) return true;
  }
  return false;
}

}  // namespace

void ImageSubscriber::subscribe(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                                const ImageTopic& source, Callback callback, Refusal refuse) {
  image_transport::ImageTransport transports(handle);
  const ros::TransportHints tcp = ros::TransportHints().tcpNoDelay();
  const auto take = [callback = std::move(callback), refuse](const sensor_msgs::ImageConstPtr& image) {
    guarded([&] { callback(image); },
            [&](const std::string& text) { refuse(image->header, Reason::kInternalError, text); });
  };
  if (source.transport == "compressed" && !has_transport(transports, source.transport)) {
    ros::NodeHandle own_handle(handle);
    compressed_ = own_handle.subscribe<sensor_msgs::CompressedImage>(
        handle.resolveName(source.name) + "/compressed", kQueueSize,
        [take, refuse, max_pixels = source.max_pixels](const sensor_msgs::CompressedImageConstPtr& message) {
          guarded([&] { take(decode_image(*message, max_pixels)); },
                  [&](const std::string& text) { refuse(message->header, Reason::kUnreadableImage, text); });
        },
        ros::VoidConstPtr(), tcp);
    return;
  }
  transported_ = transports.subscribe(source.name, kQueueSize, take, ros::VoidPtr(),
                                      image_transport::TransportHints(source.transport, tcp, private_handle));
}

std::string ImageSubscriber::topic() const {
  return compressed_ ? compressed_.getTopic() : transported_.getTopic();
}

std::uint32_t ImageSubscriber::publishers() const {
  return compressed_ ? compressed_.getNumPublishers() : transported_.getNumPublishers();
}

}  // namespace mono_pose_tracker
