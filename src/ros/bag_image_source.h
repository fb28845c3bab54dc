#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "ros/camera_info.h"

namespace mono_pose_tracker {

/// Whether the messages, of the type of compressed images, hold depth (image_transport's compressedDepth).
inline bool is_depth_topic(const std::string& topic) {
  const std::string end = "/compressedDepth";
  return topic.size() >= end.size() && topic.compare(topic.size() - end.size(), end.size(), end) == 0;
}

/// Why no image topic of a recording is chosen, and what to do. One line that continues the recording's name
/// and a colon. wanted: the topic that was asked for; empty: any. number, names: of the recording's image
/// topics.
inline std::string why_no_image_topic(const std::string& wanted, std::size_t number,
                                      const std::string& names) {
  if (number == 0) {
    return (wanted.empty() ? "has no image topic" : "has no images on " + wanted + ", nor any image topic") +
           " (compressedDepth is ignored): expected messages of the type Image or CompressedImage";
  }
  if (!wanted.empty()) return "has no images on " + wanted + ": expected one of its image topics: " + names;
  return "has " + std::to_string(number) + " image topics: choose one with --image-topic: " + names;
}

/// As why_no_image_topic, of CameraInfo.
inline std::string why_no_camera_info(const std::string& wanted, std::size_t number,
                                      const std::string& names) {
  const std::string files = "--camera (a calibration file) or --hfov (a guess)";
  if (number == 0) return "has no CameraInfo: give " + files;
  return "has no CameraInfo on " + wanted + ": expected one of its CameraInfo topics: " + names +
         "; or give " + files;
}

/// The images of one topic of a bag, or of several that were recorded one after the other (rosbag record
/// --split), raw or compressed, in the bag's order. The stamp is header.stamp (the time of recording where
/// that is zero), the name the image's number with six digits.
class BagImageSource : public ImageSource {
 public:
  /// Takes messages of `image_topic`, or of `image_topic`/compressed when there are none. An empty topic
  /// stands for the bag's only one. Throws std::runtime_error, one line that names the file, when it is no
  /// sound bag or has no such images: then it lists the image topics there are.
  BagImageSource(const std::string& path, const std::string& image_topic)
      : BagImageSource(std::vector<std::string>{path}, image_topic) {}
  /// In the order of the times of recording, whatever that of the paths.
  BagImageSource(const std::vector<std::string>& paths, const std::string& image_topic);
  ~BagImageSource() override;

  SourceImage next() override;
  bool skip() override;
  bool rewind() override;
  int size() const override;

  /// Looks at the first images that can be read, for their levels where they have 16 bits.
  void look_at_first(GreyLevelChoice* levels) const;
  /// Of images of 16 bits, from the next one on.
  void set_levels(const GreyLevels& levels) { levels_ = levels; }

  /// The topic that is read, as it is called in the bag.
  const std::string& topic() const { return topic_; }

  /// The camera by the CameraInfo messages of a topic (empty: the camera_info beside the image topic).
  /// For rectified images that is its projection matrix, without distortion; rectified: as of
  /// decide_rectification. The camera makes a CameraModel. Throws std::runtime_error, one line, when there is
  /// no such message, none of a calibrated camera, or when they are of several
  /// (kToleratedCalibrationChangePx); otherwise it is the first of them.
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
