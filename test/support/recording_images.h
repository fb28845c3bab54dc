#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "support/simulated_room.h"

namespace mono_pose_tracker {

class RoomImages : public ImageSource {
 public:
  explicit RoomImages(const SimulatedRoom& room) : room_(room) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == room_.frames.size()) return image;
    image.kind = next_ == 3 ? SourceImage::Kind::kSkipped : SourceImage::Kind::kImage;  // one cannot be read
    image.stamp_ns = static_cast<std::int64_t>(next_) * 100'000'000;
    image.name = std::to_string(next_);
    image.image = room_.frames[next_].image;
    image.problem = "image " + image.name + " is broken";
    ++next_;
    return image;
  }

 private:
  const SimulatedRoom& room_;
  std::size_t next_ = 0;
};

// The given images, one each tenth of a second; an empty one is unreadable.
class GivenImages : public ImageSource {
 public:
  explicit GivenImages(const std::vector<cv::Mat>& images) : images_(images) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == images_.size()) return image;
    image.kind = images_[next_].empty() ? SourceImage::Kind::kSkipped : SourceImage::Kind::kImage;
    image.stamp_ns = static_cast<std::int64_t>(next_) * 100'000'000;
    image.name = std::to_string(next_);
    image.image = images_[next_++];
    return image;
  }

 protected:
  std::size_t next_ = 0;

 private:
  const std::vector<cv::Mat>& images_;
};

}  // namespace mono_pose_tracker
