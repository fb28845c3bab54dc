#include "io/mask_image.h"

#include <algorithm>
#include <vector>

namespace mono_pose_tracker {

cv::Mat mask_of_image(const cv::Mat& image) {
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  // A cut-out has the object's colours, black ones among them, and what is cut out in its alpha.
  if (channels.size() == 4) {
    double least = 0, most = 0;
    cv::minMaxIdx(channels[3], &least, &most);
    if (least < most) return channels[3] != 0;
  }
  cv::Mat mask = channels[0] != 0;
  for (std::size_t i = 1; i < std::min<std::size_t>(channels.size(), 3); ++i) mask |= channels[i] != 0;
  return mask;
}

}  // namespace mono_pose_tracker
