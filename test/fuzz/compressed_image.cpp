// sensor_msgs/CompressedImage: JPEG, PNG and whatever else OpenCV would decode.
#include <stdexcept>

#include "fuzz_target.h"
#include "ros/image_conversion.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(compressed_image) {
  sensor_msgs::CompressedImage message;
  message.data.assign(bytes, bytes + size);
  try {
    constexpr std::uint64_t kMostPixels = 10'000'000;
    const sensor_msgs::ImagePtr decoded = decode_image(message, kMostPixels);
    FUZZ_CHECK(std::uint64_t{decoded->width} * decoded->height <= kMostPixels);
    FUZZ_CHECK(convert_image(decoded).reason == Reason::kOk);
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
  }
}
