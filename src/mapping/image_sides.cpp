#include "mapping/image_sides.h"

#include <array>
#include <cstddef>

namespace mono_pose_tracker {

namespace {

// Features at the left, right, upper and lower side of the image.
std::array<int, 4> count_at_sides(const std::vector<cv::Point2f>& pixels, const CameraModel& camera,
                                  double side) {
  std::array<int, 4> count{};
  for (const cv::Point2f& p : pixels) {
    count[0] += p.x < side * camera.width();
    count[1] += p.x > (1 - side) * camera.width();
    count[2] += p.y < side * camera.height();
    count[3] += p.y > (1 - side) * camera.height();
  }
  return count;
}

}  // namespace

bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera, const ImageSidesOptions& options) {
  const std::array<int, 4> of_first = count_at_sides(first, camera, options.side);
  const std::array<int, 4> of_second = count_at_sides(second, camera, options.side);
  int sides_of_first = 0, sides_of_second = 0;
  for (std::size_t i = 0; i < of_first.size(); ++i) {
    sides_of_first += of_first[i] >= options.min_features && of_first[i] > of_second[i];
    sides_of_second += of_second[i] >= options.min_features && of_second[i] >= of_first[i];
  }
  return sides_of_first > sides_of_second;
}

}  // namespace mono_pose_tracker
