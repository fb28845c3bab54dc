#pragma once

#include <sensor_msgs/Image.h>

#include <memory>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// An image as a driver would send it, and the same pixels as the tracker reads them.
struct DecodedFrame {
  std::int64_t stamp_ns = 0;
  std::string name;
  sensor_msgs::ImageConstPtr message;
  cv::Mat image;  // shares the message's memory
};

/// `image`: CV_8UC1 or CV_8UC3 (BGR).
DecodedFrame make_decoded_frame(std::int64_t stamp_ns, const std::string& name, const cv::Mat& image);

/// Images in memory, so that neither disk nor decoder is measured.
struct DecodedSequence {
  std::vector<DecodedFrame> frames;
  std::vector<std::string> problems;  // one line for each excluded image
};

/// A folder or a list of images. Throws std::runtime_error, one line, when there is none or the first does
/// not have the camera's size; later ones of another size are excluded.
DecodedSequence decode_images(const std::string& path, int max_frames, const CameraParameters& camera);

/// The sequence as a recording; it must outlive the source.
std::unique_ptr<ImageSource> make_source(const DecodedSequence& sequence);

}  // namespace mono_pose_tracker
