#include "ros/rosbag2_image_source.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "camera/camera_parameters.h"
#include "common/text.h"
#include "io/image_coding.h"
#include "io/stamp.h"
#include "ros/bag_image_source.h"
#include "ros/camera_info.h"
#include "ros/image_conversion.h"
#include "rosbag2_storage.h"

namespace mono_pose_tracker {
namespace {

/// Reads plain CDR (the encoding of ROS 2 messages, OMG DDS-XTypes 7.4.1): values lie at multiples of their
/// size behind the four bytes of the encapsulation header. Throws std::runtime_error, one line, at the end of
/// the bytes and on another encapsulation.
///
///     CdrReader in(bytes);
///     const std::uint32_t height = in.u32();
///     const std::string encoding = in.text();
class CdrReader {
 public:
  explicit CdrReader(std::string_view bytes) : bytes_(bytes) {
    if (bytes.size() < kHeaderSize || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1)) {
      throw std::runtime_error("is not encoded in plain CDR");
    }
    is_little_endian_ = bytes[1] == 1;
  }

  std::uint8_t u8() { return static_cast<std::uint8_t>(take(1)[0]); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  double f64() {
    const std::uint64_t bits = number(8);
    double value = 0;
    static_assert(sizeof value == sizeof bits);
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  /// Without the zero at its end.
  std::string text() {
    std::string_view letters = take(u32());
    if (!letters.empty() && letters.back() == '\0') letters.remove_suffix(1);
    return std::string(letters);
  }
  /// The elements of a sequence of bytes.
  std::string_view octets() { return take(u32()); }
  /// The length of a sequence of elements of the given size; there is room for them in what is left.
  std::uint32_t length(std::size_t element_size) {
    const std::uint32_t count = u32();
    if (count > (bytes_.size() - at_) / element_size) cut_short();
    return count;
  }

 private:
  static constexpr std::size_t kHeaderSize = 4;

  [[noreturn]] static void cut_short() { throw std::runtime_error("is truncated"); }

  std::string_view take(std::size_t size) {
    if (size > bytes_.size() - at_) cut_short();
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }

  std::uint64_t number(std::size_t size) {
    const std::size_t beyond = (at_ - kHeaderSize) % size;
    if (beyond > 0) take(size - beyond);
    const std::string_view digits = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t place = is_little_endian_ ? i : size - 1 - i;
      value |= std::uint64_t{static_cast<std::uint8_t>(digits[i])} << (8 * place);
    }
    return value;
  }

  std::string_view bytes_;
  std::size_t at_ = kHeaderSize;
  bool is_little_endian_ = true;
};

std::string read_ros2_header(CdrReader& in, std::int64_t* stamp_ns) {
  const std::int64_t seconds = in.i32();
  *stamp_ns = seconds * 1'000'000'000 + in.u32();
  return in.text();
}

}  // namespace

sensor_msgs::ImagePtr read_ros2_image(std::string_view cdr, std::int64_t* stamp_ns) {
  CdrReader in(cdr);
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.frame_id = read_ros2_header(in, stamp_ns);
  image->height = in.u32();
  image->width = in.u32();
  image->encoding = in.text();
  image->is_bigendian = in.u8();
  image->step = in.u32();
  const std::string_view data = in.octets();
  image->data.assign(data.begin(), data.end());
  return image;
}

std::vector<unsigned char> read_ros2_compressed_image(std::string_view cdr, std::int64_t* stamp_ns,
                                                      std::string* format) {
  CdrReader in(cdr);
  read_ros2_header(in, stamp_ns);
  const auto stated = in.text();  // the bytes decide
  if (format) *format = stated;
  const std::string_view data = in.octets();
  return {data.begin(), data.end()};
}

sensor_msgs::CameraInfo read_ros2_camera_info(std::string_view cdr, std::int64_t* stamp_ns) {
  CdrReader in(cdr);
  sensor_msgs::CameraInfo info;
  info.header.frame_id = read_ros2_header(in, stamp_ns);
  info.height = in.u32();
  info.width = in.u32();
  info.distortion_model = in.text();
  info.D.resize(in.length(sizeof(double)));
  for (double& value : info.D) value = in.f64();
  for (double& value : info.K) value = in.f64();
  for (double& value : info.R) value = in.f64();
  for (double& value : info.P) value = in.f64();
  info.binning_x = in.u32();
  info.binning_y = in.u32();
  info.roi.x_offset = in.u32();
  info.roi.y_offset = in.u32();
  info.roi.height = in.u32();
  info.roi.width = in.u32();
  info.roi.do_rectify = in.u8();
  return info;
}

namespace {

const char* const kRos2Image = "sensor_msgs/msg/Image";
const char* const kRos2Compressed = "sensor_msgs/msg/CompressedImage";
const char* const kRos2CameraInfo = "sensor_msgs/msg/CameraInfo";
const std::string kCompressedTopic = "/compressed";

/// Users leave the slash away.
std::string without_slash(const std::string& topic) {
  const std::size_t start = topic.find_first_not_of('/');
  return start == std::string::npos ? "" : topic.substr(start);
}

std::vector<StoredTopic> topics_of_types(const MessageStorage& storage, const std::set<std::string>& types) {
  std::vector<StoredTopic> found;
  for (const StoredTopic& topic : storage.topics()) {
    if (types.count(topic.type) > 0) found.push_back(topic);
  }
  return found;
}

std::string names_of_topics(const std::vector<StoredTopic>& topics) {
  std::string text;
  for (const StoredTopic& topic : topics) text += (text.empty() ? "" : ", ") + one_line(topic.name);
  return text.empty() ? "none" : text;
}

const StoredTopic* topic_called(const std::vector<StoredTopic>& topics, const std::string& name) {
  for (const StoredTopic& topic : topics) {
    if (!without_slash(name).empty() && without_slash(topic.name) == without_slash(name)) return &topic;
  }
  return nullptr;
}

StoredTopic choose_ros2_topic(const std::string& path, const MessageStorage& storage,
                              const std::string& wanted) {
  std::vector<StoredTopic> topics = topics_of_types(storage, {kRos2Image, kRos2Compressed});
  topics.erase(std::remove_if(topics.begin(), topics.end(),
                              [](const StoredTopic& topic) { return is_depth_topic(topic.name); }),
               topics.end());
  const StoredTopic* chosen = wanted.empty() && topics.size() == 1 ? &topics.front() : nullptr;
  if (!chosen && !wanted.empty()) chosen = topic_called(topics, wanted);
  if (!chosen && !wanted.empty()) chosen = topic_called(topics, wanted + kCompressedTopic);
  if (!chosen) {
    throw std::runtime_error(path + ": " +
                             why_no_image_topic(wanted, topics.size(), names_of_topics(topics)));
  }
  if (chosen->serialization != "cdr") {
    throw std::runtime_error(path + ": " + one_line(chosen->name) + " is serialised as '" +
                             one_line(chosen->serialization) + "': expected cdr");
  }
  return *chosen;
}

/// By image_transport's rules: /camera/image_raw/compressed -> /camera.
std::string name_space_of_camera(std::string topic) {
  const std::size_t end = topic.size() - std::min(topic.size(), kCompressedTopic.size());
  if (topic.compare(end, std::string::npos, kCompressedTopic) == 0) topic.resize(end);
  const std::size_t slash = topic.rfind('/');
  return slash == std::string::npos ? "" : topic.substr(0, slash);
}

/// The camera of all messages; those before the camera was calibrated do not count.
ConvertedCamera camera_of_messages(MessageCursor& messages, bool rectified) {
  std::optional<ConvertedCamera> camera;
  std::string problem = "holds no message";
  StoredMessage message;
  while (messages.next(&message)) {
    std::int64_t stamp_ns = 0;
    const ConvertedCamera converted =
        convert_camera_info(read_ros2_camera_info(message.data, &stamp_ns), rectified);
    if (converted.reason != Reason::kOk) {
      problem = converted.error;
      continue;
    }
    if (camera && !is_same_camera(camera->parameters, converted.parameters, kToleratedCalibrationChangePx)) {
      throw std::runtime_error(
          "the calibration changes at " + format_stamp(stamp_ns == 0 ? message.time_ns : stamp_ns) +
          ": expected one calibration in the whole recording, or a calibration file (--camera)");
    }
    if (!camera) camera = converted;
  }
  if (!camera) throw std::runtime_error(problem);
  return *camera;
}

/// Fills in image or problem, and the stamp.
void decode_ros2_image(const StoredTopic& topic, const StoredMessage& message, const GreyLevels& levels,
                       SourceImage* result) {
  if (topic.type == kRos2Compressed) {
    std::string format;
    const DecodedImage decoded = decode_image(
        read_ros2_compressed_image(message.data, &result->stamp_ns, &format), kMaxImagePixels, levels);
    result->image = decoded.image;
    result->mask = decoded.mask;
    result->problem = with_format(decoded.problem, format);
    return;
  }
  const ConvertedImage converted = convert_image(read_ros2_image(message.data, &result->stamp_ns), levels);
  result->image = converted.image.clone();  // it may share the message's memory
  result->mask = converted.mask;
  result->problem = converted.error;
}

/// With all bits of its pixels; empty where it cannot be read.
cv::Mat ros2_image_with_all_bits(const StoredTopic& topic, const StoredMessage& message) {
  std::int64_t stamp_ns = 0;
  if (topic.type == kRos2Compressed) {
    return decode_unchanged(read_ros2_compressed_image(message.data, &stamp_ns)).image;
  }
  return convert_with_all_bits(read_ros2_image(message.data, &stamp_ns)).image.clone();
}

}  // namespace

struct Rosbag2ImageSource::Bag {
  std::unique_ptr<MessageStorage> storage;
  StoredTopic topic;
  std::unique_ptr<MessageCursor> images;
};

Rosbag2ImageSource::Rosbag2ImageSource(const std::string& path, const std::string& image_topic)
    : path_(path), bag_(std::make_unique<Bag>()) {
  bag_->storage = open_rosbag2(path);
  bag_->topic = choose_ros2_topic(path, *bag_->storage, image_topic);
  topic_ = bag_->topic.name;
  bag_->images = bag_->storage->open(topic_);
}

Rosbag2ImageSource::~Rosbag2ImageSource() = default;

int Rosbag2ImageSource::size() const { return bag_->images->size(); }

SourceImage Rosbag2ImageSource::next() {
  SourceImage result;
  std::ostringstream name;
  name << std::setw(6) << std::setfill('0') << index_;
  StoredMessage message;
  try {
    if (!bag_->images->next(&message)) return {};
    decode_ros2_image(bag_->topic, message, levels_, &result);
  } catch (const std::exception& error) {  // a damaged part of the file
    result.problem = one_line(error.what());
  }
  ++index_;
  result.mask_name = name.str();
  result.name = result.mask_name + ".png";
  if (result.stamp_ns == 0) result.stamp_ns = message.time_ns;
  result.kind = result.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
  if (!result.problem.empty()) {
    result.problem =
        path_ + ": image " + result.mask_name + " of " + one_line(topic_) + ": " + result.problem;
    result.image.release();
  }
  return result;
}

bool Rosbag2ImageSource::skip() {
  ++index_;
  try {
    return bag_->images->skip();
  } catch (const std::exception&) {  // it was told when it was read
    return true;
  }
}

bool Rosbag2ImageSource::rewind() {
  bag_->images->rewind();
  index_ = 0;
  return true;
}

void Rosbag2ImageSource::look_at_first(GreyLevelChoice* levels) const {
  const std::unique_ptr<MessageCursor> images = bag_->storage->open(topic_);
  StoredMessage message;
  for (bool goes_on = true; goes_on && !levels->is_settled();) {
    cv::Mat image;
    try {
      goes_on = images->next(&message);
      if (goes_on) image = ros2_image_with_all_bits(bag_->topic, message);
    } catch (const std::exception&) {  // reported when its turn comes
    }
    if (!image.empty() && image.depth() != CV_16U) return;
    levels->look_at(image);
  }
}

ConvertedCamera Rosbag2ImageSource::read_calibration(const std::string& camera_info_topic,
                                                     const std::string& rectified) const {
  const std::string wanted =
      camera_info_topic.empty() ? name_space_of_camera(topic_) + "/camera_info" : camera_info_topic;
  const std::vector<StoredTopic> topics = topics_of_types(*bag_->storage, {kRos2CameraInfo});
  const StoredTopic* topic = topic_called(topics, wanted);
  // Some drivers call their images /axis/compressed, and have /axis/camera_info beside them.
  if (!topic && camera_info_topic.empty()) {
    topic = topic_called(topics, topic_.substr(0, topic_.rfind('/') + 1) + "camera_info");
  }
  if (!topic) {
    throw std::runtime_error(path_ + ": " +
                             why_no_camera_info(one_line(wanted), topics.size(), names_of_topics(topics)));
  }
  try {
    return camera_of_messages(*bag_->storage->open(topic->name),
                              decide_rectification(rectified, topic_).is_rectified);
  } catch (const std::exception& error) {
    throw std::runtime_error(path_ + ": " + one_line(topic->name) + ": " + one_line(error.what()));
  }
}

}  // namespace mono_pose_tracker
