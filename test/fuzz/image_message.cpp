// sensor_msgs/Image as it comes off the wire: any field may contradict any other.
#include <boost/make_shared.hpp>

#include "fuzz_target.h"
#include "ros/image_conversion.h"

using namespace mono_pose_tracker;

namespace {

constexpr const char* kEncodings[] = {
    "mono8",       "mono16",       "8UC1",         "16UC1",        "8UC3",         "rgb8",
    "bgr8",        "rgba8",        "bgra8",        "bayer_rggb8",  "bayer_bggr8",  "bayer_gbrg8",
    "bayer_grbg8", "bayer_rggb16", "bayer_bggr16", "bayer_gbrg16", "bayer_grbg16", "yuv422",
    "yuv422_yuy2", "32FC1",        "64FC4",        "8UC4",         "rgb16",        ""};

void check(const ConvertedImage& converted, const sensor_msgs::Image& message) {
  if (converted.reason != Reason::kOk) {
    FUZZ_CHECK(converted.image.empty() && is_one_line(converted.error.c_str()));
    return;
  }
  FUZZ_CHECK(converted.image.type() == CV_8UC1 || converted.image.type() == CV_8UC3);
  FUZZ_CHECK(converted.image.cols == static_cast<int>(message.width));
  FUZZ_CHECK(converted.image.rows == static_cast<int>(message.height));
  cv::sum(converted.image);  // every pixel can be read
}

}  // namespace

FUZZ_TARGET(image_message) {
  FuzzInput input(bytes, size);
  auto message = boost::make_shared<sensor_msgs::Image>();
  const auto choice = input.take<std::uint8_t>();
  const bool is_listed = choice < sizeof(kEncodings) / sizeof(kEncodings[0]);
  message->encoding = is_listed ? kEncodings[choice] : input.take_text(choice % 16);
  message->width = input.take<std::uint32_t>();
  message->height = input.take<std::uint32_t>();
  message->step = input.take<std::uint32_t>();
  message->is_bigendian = input.take<std::uint8_t>();
  const std::string data = input.take_rest();
  message->data.assign(data.begin(), data.end());
  check(convert_image(message), *message);
  const ConvertedImage mask = convert_mask(message);
  check(mask, *message);
  FUZZ_CHECK(mask.image.empty() || mask.image.type() == CV_8UC1);
}
