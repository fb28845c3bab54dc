// sensor_msgs/CompressedImage: JPEG, PNG and whatever else OpenCV would decode.
#include "fuzz_input.h"
#include "fuzz_target.h"
#include "mono_pose_tracker/ros/image_conversion.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(compressed_image) {
  sensor_msgs::CompressedImage message;
  message.data.assign(bytes, bytes + size);
  const sensor_msgs::ImagePtr decoded = decode_image(message);
  FUZZ_CHECK(decoded != nullptr);
  const ConvertedImage converted = convert_image(decoded);
  FUZZ_CHECK(decoded->data.empty() ? converted.reason != Reason::kOk : converted.reason == Reason::kOk);
}
