#include "ros/bag_image_source.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "camera/camera_parameters.h"
#include "common/text.h"
#include "io/image_coding.h"
#include "io/stamp.h"
#include "ros/camera_info.h"
#include "ros/image_conversion.h"

namespace mono_pose_tracker {
namespace {

const char* const kCompressed = "/compressed";

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Topics in a bag are absolute more often than not, and users leave the slash away.
bool same_topic(const std::string& a, const std::string& b) {
  const auto start = [](const std::string& topic) { return topic.find_first_not_of('/'); };
  return start(a) != std::string::npos && start(b) != std::string::npos &&
         a.compare(start(a), std::string::npos, b, start(b), std::string::npos) == 0;
}

/// Describes a path that is no bag of ROS 1, with advice; empty if it begins as one.
std::string other_kind(const std::string& path) {
  const std::string recorded = ": expected a bag that rosbag has recorded";
  const std::string convert =
      ": expected a bag of ROS 1; `rosbags-convert` (pip install rosbags) converts it";
  std::error_code ignored;
  if (std::filesystem::exists(std::filesystem::path(path) / "metadata.yaml", ignored)) {
    return "is a recording of ROS 2" + convert;
  }
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return "does not exist or is not a regular file" + recorded;
  }
  std::string head(16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (file.gcount() == 0) return "is empty" + recorded;
  const auto begins_with = [&](const std::string& mark) { return head.compare(0, mark.size(), mark) == 0; };
  if (begins_with("#ROSBAG")) return "";
  if (begins_with("\x89MCAP")) return "is an MCAP file" + convert;
  if (begins_with("SQLite format 3")) return "is a recording of ROS 2 (SQLite)" + convert;
  const bool is_video = head.compare(4, 4, "ftyp") == 0 || begins_with("\x1a\x45\xdf\xa3") ||
                        begins_with("RIFF") || begins_with(std::string("\0\0\1\xba", 4)) || begins_with("G@");
  return is_video ? "is a video: give it with --video" : "is not a bag" + recorded;
}

void open(const std::string& path, rosbag::Bag* bag) {
  const auto fail = [&](const std::string& problem) { throw std::runtime_error(path + ": " + problem); };
  const std::string other = other_kind(path);
  if (!other.empty()) fail(other);
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    fail("has no index (the recording was interrupted): expected a closed bag; `rosbag reindex` repairs it");
  } catch (const rosbag::BagIOException&) {  // the index lies beyond the end
    fail(
        "ends too early (an incomplete copy?): expected a closed bag; copy it again, or `rosbag reindex` "
        "repairs what is there");
  } catch (const std::exception& error) {
    fail("cannot be read as a bag (" + one_line(error.what()) + "): expected a bag of format 2.0");
  }
}

using Bags = std::vector<std::unique_ptr<rosbag::Bag>>;

/// Topics whose messages are of one of the given types.
std::set<std::string> topics_of(const Bags& bags, const std::set<std::string>& types) {
  rosbag::View all;
  for (const auto& bag : bags) all.addQuery(*bag);
  std::set<std::string> topics;
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    if (types.count(connection->datatype)) topics.insert(connection->topic);
  }
  return topics;
}

/// The messages of a topic in all bags, in the order in which they were recorded.
void add_topic(const Bags& bags, const std::string& topic, rosbag::View* view) {
  for (const auto& bag : bags) view->addQuery(*bag, rosbag::TopicQuery(topic));
}

std::string listed(const std::vector<std::string>& paths) {
  return paths.front() + (paths.size() > 1 ? " and " + std::to_string(paths.size() - 1) + " more" : "");
}

std::string listed(const std::set<std::string>& topics) {
  std::string text;
  for (const std::string& topic : topics) text += (text.empty() ? "" : ", ") + topic;
  return text.empty() ? "none" : text;
}

std::string choose_image_topic(const std::string& path, const Bags& bags, const std::string& wanted) {
  std::set<std::string> topics;
  for (const std::string& topic : topics_of(bags, {"sensor_msgs/Image", "sensor_msgs/CompressedImage"})) {
    if (!is_depth_topic(topic)) topics.insert(topic);
  }
  if (wanted.empty() && topics.size() == 1) return *topics.begin();
  for (const std::string& name : {wanted, wanted + kCompressed}) {
    for (const std::string& topic : topics) {
      if (same_topic(topic, name)) return topic;
    }
  }
  throw std::runtime_error(path + ": " + why_no_image_topic(wanted, topics.size(), listed(topics)));
}

/// The camera's own name space, by image_transport's rules: /camera/image_raw/compressed -> /camera.
std::string camera_of(std::string image_topic) {
  if (ends_with(image_topic, kCompressed))
    image_topic.resize(image_topic.size() - std::string(kCompressed).size());
  const std::size_t slash = image_topic.rfind('/');
  return slash == std::string::npos ? "" : image_topic.substr(0, slash);
}

std::int64_t stamp_of(const rosbag::MessageInstance& message, const std_msgs::Header& header) {
  return static_cast<std::int64_t>((header.stamp.isZero() ? message.getTime() : header.stamp).toNSec());
}

/// Fills in image or problem, and the stamp.
void read_raw(const rosbag::MessageInstance& message, const GreyLevels& levels, SourceImage* result) {
  const sensor_msgs::ImageConstPtr image = message.instantiate<sensor_msgs::Image>();
  if (!image) throw std::runtime_error("has another version of sensor_msgs/Image");
  result->stamp_ns = static_cast<std::int64_t>(image->header.stamp.toNSec());
  const ConvertedImage converted = convert_image(image, levels);
  result->image = converted.image.clone();  // it may share the message's memory
  result->mask = converted.mask;
  result->problem = converted.error;
}

void read_compressed(const rosbag::MessageInstance& message, const GreyLevels& levels, SourceImage* result) {
  const sensor_msgs::CompressedImageConstPtr image = message.instantiate<sensor_msgs::CompressedImage>();
  if (!image) throw std::runtime_error("has another version of sensor_msgs/CompressedImage");
  result->stamp_ns = static_cast<std::int64_t>(image->header.stamp.toNSec());
  const DecodedImage decoded = decode_image(image->data, kMaxImagePixels, levels);
  result->image = decoded.image;
  result->mask = decoded.mask;
  result->problem = with_format(decoded.problem, image->format);
}

/// With all bits of its pixels; empty where it can't be read.
cv::Mat all_bits_of(const rosbag::MessageInstance& message) {
  if (const auto raw = message.instantiate<sensor_msgs::Image>())
    return convert_with_all_bits(raw).image.clone();
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed ? decode_unchanged(compressed->data).image : cv::Mat();
}

/// The camera of all CameraInfo messages; uncalibrated ones are ignored. Throws when there is none, or more
/// than one: an outdated calibration would silently give wrong poses.
ConvertedCamera camera_of_all(rosbag::View& view, bool rectified) {
  std::optional<ConvertedCamera> camera;
  std::string problem;
  for (const rosbag::MessageInstance& message : view) {
    const sensor_msgs::CameraInfoConstPtr info = message.instantiate<sensor_msgs::CameraInfo>();
    if (!info) throw std::runtime_error("has another version of sensor_msgs/CameraInfo");
    const ConvertedCamera converted = convert_camera_info(*info, rectified);
    if (converted.reason != Reason::kOk) {
      problem = converted.error;
      continue;
    }
    if (camera && !is_same_camera(camera->parameters, converted.parameters, kToleratedCalibrationChangePx)) {
      throw std::runtime_error(
          "the calibration changes at " + format_stamp(stamp_of(message, info->header)) + " (" +
          difference(camera->parameters, converted.parameters) +
          "): expected one calibration in the whole bag, or a calibration file (--camera)");
    }
    if (!camera) camera = converted;
  }
  if (!camera) throw std::runtime_error(problem);
  return *camera;
}

}  // namespace

struct BagImageSource::Bag {
  Bags files;
  rosbag::View images;
  rosbag::View::iterator position;
};

BagImageSource::BagImageSource(const std::vector<std::string>& paths, const std::string& image_topic)
    : path_(listed(paths)), bag_(std::make_unique<Bag>()) {
  for (const std::string& path : paths) {
    bag_->files.push_back(std::make_unique<rosbag::Bag>());
    open(path, bag_->files.back().get());
  }
  topic_ = choose_image_topic(path_, bag_->files, image_topic);
  add_topic(bag_->files, topic_, &bag_->images);
  bag_->position = bag_->images.begin();
}

BagImageSource::~BagImageSource() = default;

int BagImageSource::size() const { return static_cast<int>(bag_->images.size()); }

SourceImage BagImageSource::next() {
  if (bag_->position == bag_->images.end()) return {};
  SourceImage result;
  std::ostringstream name;
  name << std::setw(6) << std::setfill('0') << index_++;
  result.mask_name = name.str();
  result.name = result.mask_name + ".png";
  try {
    const rosbag::MessageInstance& message = *bag_->position;
    (message.getDataType() == "sensor_msgs/Image" ? read_raw : read_compressed)(message, levels_, &result);
  } catch (const std::exception& error) {  // a damaged part of the file
    result.problem = one_line(error.what());
  }
  if (result.stamp_ns == 0) result.stamp_ns = static_cast<std::int64_t>(bag_->position->getTime().toNSec());
  ++bag_->position;
  result.kind = result.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
  if (!result.problem.empty()) {
    result.problem = path_ + ": image " + result.mask_name + " of " + topic_ + ": " + result.problem;
    result.image.release();
  }
  return result;
}

void BagImageSource::look_at_first(GreyLevelChoice* levels) const {
  rosbag::View images;
  add_topic(bag_->files, topic_, &images);
  for (const rosbag::MessageInstance& message : images) {
    if (levels->is_settled()) return;
    cv::Mat image;
    try {
      image = all_bits_of(message);
    } catch (const std::exception&) {  // told when it is its turn
    }
    if (!image.empty() && image.depth() != CV_16U) return;
    levels->look_at(image);
  }
}

bool BagImageSource::skip() {
  if (bag_->position == bag_->images.end()) return false;
  ++bag_->position;
  ++index_;
  return true;
}

bool BagImageSource::rewind() {
  bag_->position = bag_->images.begin();
  index_ = 0;
  return true;
}

ConvertedCamera BagImageSource::read_calibration(const std::string& camera_info_topic,
                                                 const std::string& rectified) const {
  const std::string wanted =
      camera_info_topic.empty() ? camera_of(topic_) + "/camera_info" : camera_info_topic;
  const std::set<std::string> topics = topics_of(bag_->files, {"sensor_msgs/CameraInfo"});
  // Some drivers publish images on /axis/compressed and the calibration on /axis/camera_info.
  const std::string default_topic = topic_.substr(0, topic_.rfind('/') + 1) + "camera_info";
  const bool is_there = std::any_of(topics.begin(), topics.end(),
                                    [&](const std::string& topic) { return same_topic(topic, wanted); });
  const bool uses_default_topic = camera_info_topic.empty() && !is_there;
  const auto fail = [&](const std::string& problem) { throw std::runtime_error(path_ + ": " + problem); };
  for (const std::string& topic : topics) {
    if (!same_topic(topic, uses_default_topic ? default_topic : wanted)) continue;
    rosbag::View view;
    add_topic(bag_->files, topic, &view);
    if (view.begin() == view.end()) break;
    try {
      return camera_of_all(view, decide_rectification(rectified, topic_).is_rectified);
    } catch (const std::exception& error) {
      fail(topic + ": " + one_line(error.what()));
    }
  }
  fail(why_no_camera_info(wanted, topics.size(), listed(topics)));
  return {};
}

}  // namespace mono_pose_tracker
