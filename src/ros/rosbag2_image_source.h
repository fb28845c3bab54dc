#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "ros/camera_info.h"

namespace mono_pose_tracker {

// Messages of ROS 2 in CDR. `stamp_ns` is header.stamp, which may be negative there; the header of the
// message of ROS 1 stays empty but for its frame_id. Each throws std::runtime_error, one line, when the bytes
// are none.

/// sensor_msgs/msg/Image.
sensor_msgs::ImagePtr read_ros2_image(std::string_view cdr, std::int64_t* stamp_ns);

/// sensor_msgs/msg/CompressedImage: the bytes of the image file. format: what the message states; null: not
/// wanted.
std::vector<unsigned char> read_ros2_compressed_image(std::string_view cdr, std::int64_t* stamp_ns,
                                                      std::string* format = nullptr);

/// sensor_msgs/msg/CameraInfo.
sensor_msgs::CameraInfo read_ros2_camera_info(std::string_view cdr, std::int64_t* stamp_ns);

/// Whether the path is of a recording of ROS 2: a folder with metadata.yaml, .db3 or .mcap files, or such a
/// file, by its extension or its first bytes.
bool is_rosbag2(const std::string& path);

/// The images of one topic of a ROS 2 recording (rosbag2: SQLite or MCAP; CDR), raw or compressed, in the
/// order of recording. ROS 2 need not be installed. Otherwise as BagImageSource.
///
///     Rosbag2ImageSource source("drive", "/camera/image_raw");
///     const CameraParameters camera = source.read_camera();
///     for (SourceImage image = source.next(); image.kind != SourceImage::Kind::kEnd; image = source.next())
///     ...
class Rosbag2ImageSource : public ImageSource {
 public:
  /// Takes messages of `image_topic`, or of `image_topic`/compressed when there are none. An empty topic
  /// stands for the recording's only one. Throws std::runtime_error, one line that names the file, when it is
  /// not sound or has no such images: then it lists the image topics there are.
  Rosbag2ImageSource(const std::string& path, const std::string& image_topic);
  ~Rosbag2ImageSource() override;

  SourceImage next() override;
  bool skip() override;
  bool rewind() override;
  int size() const override;

  /// Looks at the first images that can be read, for their levels where they have 16 bits.
  void look_at_first(GreyLevelChoice* levels) const;
  /// Of images of 16 bits, from the next one on.
  void set_levels(const GreyLevels& levels) { levels_ = levels; }

  /// The topic that is read, as it is called in the recording.
  const std::string& topic() const { return topic_; }

  /// As BagImageSource::read_calibration.
  ConvertedCamera read_calibration(const std::string& camera_info_topic, const std::string& rectified) const;
  CameraParameters read_camera(const std::string& camera_info_topic = "") const {
    return read_calibration(camera_info_topic, "auto").parameters;
  }

 private:
  struct Bag;

  std::string path_, topic_;
  std::unique_ptr<Bag> bag_;
  GreyLevels levels_;
  std::int64_t index_ = 0;
};

}  // namespace mono_pose_tracker
