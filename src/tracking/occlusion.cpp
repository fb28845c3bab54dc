#include "occlusion.h"

#include <algorithm>
#include <unordered_set>

#include "mono_pose_tracker/camera/image_scale.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px (image_scale): about two descriptors wide, so that a few landmarks are expected within.
constexpr double kNear = 40;
// Of as many as are found elsewhere in the image, after a large step fewer than after a small one; behind a
// hand next to none are.
constexpr double kMinOfUsual = 0.375;

double found_share(const std::vector<ExpectedLandmark>& landmarks) {
  const auto found =
      std::count_if(landmarks.begin(), landmarks.end(), [](const ExpectedLandmark& l) { return l.found; });
  return landmarks.empty() ? 0 : static_cast<double>(found) / static_cast<double>(landmarks.size());
}

}  // namespace

std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  double scale, bool is_mask_given) {
  const double near = kNear * scale, usual = found_share(landmarks);
  std::vector<char> flags(image.size());
  for (int i = 0; i < image.size(); ++i) {
    const Eigen::Vector2d pixel = image.set.features[i].pixel.cast<double>();
    int expected = 0, found = 0;
    for (const ExpectedLandmark& l : landmarks) {
      if ((l.pixel - pixel).squaredNorm() > near * near) continue;
      ++expected;
      found += l.found;
    }
    // One less than would be too few: by chance that happens in one place of fourteen where nearly three are
    // usual, in one of thirty where five are.
    const bool is_hidden = found + 1 <= kMinOfUsual * usual * expected;
    flags[i] = !is_hidden && (found > 0 || is_mask_given);
  }
  return flags;
}

void leave_out_occluders(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map,
                         KeyframeCandidate* candidate) {
  std::unordered_set<LandmarkId> seen;
  for (const FrameObservation& o : candidate->observations) seen.insert(o.landmark);
  std::vector<ExpectedLandmark> expected;
  for (const LandmarkId id : map.keyframes.at(candidate->reference).landmark_of_feature) {
    const auto landmark = map.landmarks.find(id);
    Eigen::Vector2d pixel;
    if (landmark == map.landmarks.end() || seen.count(id) > 0 ||
        !camera.project(camera_from_map * landmark->second, &pixel) || !camera.in_image(pixel)) {
      continue;
    }
    expected.push_back({pixel, false});
  }
  const ImageFeatures& image = *candidate->frame.image;
  for (const FrameObservation& o : candidate->observations) {
    expected.push_back({image.set.features[o.feature].pixel.cast<double>(), true});
  }
  std::vector<char> flags =
      features_to_map(image, expected, image_scale(camera), candidate->frame.is_mask_given);
  for (const FrameObservation& o : candidate->observations) flags[o.feature] = 1;
  std::vector<int> new_index(flags.size());
  int kept = 0;
  for (std::size_t i = 0; i < flags.size(); ++i) new_index[i] = flags[i] ? kept++ : -1;
  candidate->frame.image = select_features(image, flags, camera.width(), camera.height());
  for (FrameObservation& o : candidate->observations) o.feature = new_index[o.feature];
}

}  // namespace mono_pose_tracker
