#include "sequence.h"

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>

#include <stdexcept>

#include "ros/image_conversion.h"

namespace mono_pose_tracker {
namespace {

class MemorySource : public ImageSource {
 public:
  explicit MemorySource(const DecodedSequence& sequence) : frames_(sequence.frames) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == frames_.size()) return image;
    const DecodedFrame& frame = frames_[next_++];
    image.kind = SourceImage::Kind::kImage;
    image.stamp_ns = frame.stamp_ns;
    image.name = frame.name;
    image.image = frame.image;
    return image;
  }
  int size() const override { return static_cast<int>(frames_.size()); }

 private:
  const std::vector<DecodedFrame>& frames_;
  std::size_t next_ = 0;
};

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

DecodedFrame make_decoded_frame(std::int64_t stamp_ns, const std::string& name, const cv::Mat& image) {
  namespace enc = sensor_msgs::image_encodings;
  std_msgs::Header header;
  header.frame_id = "camera_optical";
  header.stamp.fromNSec(static_cast<std::uint64_t>(stamp_ns));
  DecodedFrame frame;
  frame.stamp_ns = stamp_ns;
  frame.name = name;
  frame.message =
      cv_bridge::CvImage(header, image.channels() == 1 ? enc::MONO8 : enc::BGR8, image).toImageMsg();
  frame.image = convert_image(frame.message).image;
  return frame;
}

DecodedSequence decode_images(const std::string& path, int max_frames, const CameraParameters& camera) {
  DecodedSequence sequence;
  const std::unique_ptr<ImageSource> source = open_images(path);
  while (max_frames < 0 || static_cast<int>(sequence.frames.size()) < max_frames) {
    const SourceImage next = source->next();
    if (next.kind == SourceImage::Kind::kEnd) break;
    if (next.kind == SourceImage::Kind::kSkipped) {
      sequence.problems.push_back(next.problem);
      continue;
    }
    if (next.image.cols != camera.width || next.image.rows != camera.height) {
      const std::string problem = next.name + ": is " + size_text(next.image.cols, next.image.rows) +
                                  ", the calibration is for " + size_text(camera.width, camera.height);
      if (sequence.frames.empty()) throw std::runtime_error(problem);
      sequence.problems.push_back(problem);
      continue;
    }
    sequence.frames.push_back(make_decoded_frame(next.stamp_ns, next.name, next.image));
  }
  if (sequence.frames.empty()) {
    throw std::runtime_error("no image could be read: " +
                             (sequence.problems.empty() ? "there is none" : sequence.problems.front()));
  }
  return sequence;
}

std::unique_ptr<ImageSource> make_source(const DecodedSequence& sequence) {
  return std::make_unique<MemorySource>(sequence);
}

}  // namespace mono_pose_tracker
