#include "occlusion.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

// px at 640 px width or less: about two descriptors wide, so that a few landmarks are expected within.
constexpr double kNear = 40;
// A feature is found again in two images of three; of those behind a hand next to none.
constexpr double kMinFound = 0.25;

}  // namespace

std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  int image_width) {
  const double near = kNear * std::max(1.0, image_width / 640.0);
  std::vector<char> flags(image.size());
  for (int i = 0; i < image.size(); ++i) {
    const Eigen::Vector2d pixel = image.set.features[i].pixel.cast<double>();
    int expected = 0, found = 0;
    for (const ExpectedLandmark& l : landmarks) {
      if ((l.pixel - pixel).squaredNorm() > near * near) continue;
      ++expected;
      found += l.found;
    }
    flags[i] = found > 0 && found >= kMinFound * expected;
  }
  return flags;
}

}  // namespace mono_pose_tracker
