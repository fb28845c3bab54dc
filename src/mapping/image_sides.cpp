#include "mapping/image_sides.h"

#include <array>
#include <cstddef>

namespace mono_pose_tracker {

namespace {

// A side is of those that have so many features there, and most.
constexpr double kSide = 1.0 / 8;
constexpr int kMinAtSide = 3;

// Features at the left, right, upper and lower side of the image.
std::array<int, 4> count_at_sides(const std::vector<cv::Point2f>& pixels, const CameraModel& camera) {
  std::array<int, 4> count{};
  for (const cv::Point2f& p : pixels) {
    count[0] += p.x < kSide * camera.width();
    count[1] += p.x > (1 - kSide) * camera.width();
    count[2] += p.y < kSide * camera.height();
    count[3] += p.y > (1 - kSide) * camera.height();
  }
  return count;
}

}  // namespace

bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera) {
  const std::array<int, 4> of_first = count_at_sides(first, camera);
  const std::array<int, 4> of_second = count_at_sides(second, camera);
  int sides_of_first = 0, sides_of_second = 0;
  for (std::size_t i = 0; i < of_first.size(); ++i) {
    sides_of_first += of_first[i] >= kMinAtSide && of_first[i] > of_second[i];
    sides_of_second += of_second[i] >= kMinAtSide && of_second[i] >= of_first[i];
  }
  return sides_of_first > sides_of_second;
}

}  // namespace mono_pose_tracker
