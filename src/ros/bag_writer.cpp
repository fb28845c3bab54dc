#include "ros/bag_writer.h"

#include <console_bridge/console.h>
#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "io/stamp.h"
#include "ros/camera_info.h"

namespace mono_pose_tracker {
namespace {

/// A bag refuses a record at time 0, which a header may well hold.
ros::Time record_time(const ros::Time& stamp) { return std::max(stamp, ros::TIME_MIN); }

std_msgs::Header header_of(std::int64_t stamp_ns) {
  std_msgs::Header header;
  header.frame_id = "camera_optical";
  header.stamp.fromNSec(static_cast<std::uint64_t>(stamp_ns));
  return header;
}

/// Leaves a bag that can't be closed: its destructor would close it again, and end the process by what that
/// throws. At the exit class_loader 2.8 would warn of the plugin that the bag holds.
void leave(rosbag::Bag*) { console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_ERROR); }

}  // namespace

void require_message_stamp(const std::string& of_what, std::int64_t stamp_ns) {
  constexpr std::int64_t kEnd = (std::int64_t{1} << 32) * 1'000'000'000;
  if (stamp_ns >= 0 && stamp_ns < kEnd) return;
  throw std::runtime_error(of_what + ": the time stamp " + format_stamp(stamp_ns) +
                           " s cannot be stored in a bag: expected 0 to 4294967295");
}

void BagWriter::EndBag::operator()(rosbag::Bag* bag) const {
  try {
    bag->close();
    delete bag;
  } catch (const std::exception&) {
    leave(bag);
  }
}

BagWriter::BagWriter(const std::string& path, const std::optional<CameraParameters>& camera, int jpeg_quality)
    : path_(path), jpeg_quality_(jpeg_quality), bag_(new rosbag::Bag) {
  if (camera) info_ = to_camera_info(*camera);
  try {
    bag_->open(path, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path + ": cannot be written (" + error.what() + ")");
  }
}

template <typename Message>
void BagWriter::write_message(const std::string& topic, const Message& message) {
  try {
    bag_->write(topic, record_time(message.header.stamp), message);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path_ + ": cannot be written (" + error.what() + ")");
  }
}

void BagWriter::write_raw(const std::string& topic, std::int64_t stamp_ns, const cv::Mat& image) {
  namespace encodings = sensor_msgs::image_encodings;
  const char* encoding = image.channels() == 1 ? encodings::MONO8.c_str() : encodings::BGR8.c_str();
  write_message(topic, *cv_bridge::CvImage(header_of(stamp_ns), encoding, image).toImageMsg());
}

void BagWriter::write_jpeg(std::int64_t stamp_ns, const cv::Mat& image) {
  sensor_msgs::CompressedImage message;
  message.header = header_of(stamp_ns);
  message.format = "jpeg";
  cv::imencode(".jpg", image, message.data, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality_});
  write_message("/camera/image_raw/compressed", message);
}

void BagWriter::write(std::int64_t stamp_ns, const cv::Mat& image) {
  if (jpeg_quality_ > 0) {
    write_jpeg(stamp_ns, image);
  } else {
    write_raw("/camera/image_raw", stamp_ns, image);
  }
  if (!info_) return;
  info_->header = header_of(stamp_ns);
  write_message("/camera/camera_info", *info_);
}

void BagWriter::write_mask(std::int64_t stamp_ns, const cv::Mat& mask) {
  write_raw("/camera/mask", stamp_ns, mask);
}

void BagWriter::close() {
  try {
    bag_->close();
  } catch (const rosbag::BagException& error) {
    leave(bag_.release());
    throw std::runtime_error(path_ + ": cannot be written (" + error.what() + ")");
  }
}

}  // namespace mono_pose_tracker
