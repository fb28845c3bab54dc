#include "occlusion.h"

#include <unordered_set>
#include <utility>

#include "common/statistics.h"

namespace mono_pose_tracker {

namespace {

constexpr OcclusionOptions kOcclusion{};

// Landmarks near a place, and the number of found ones.
struct Seen {
  int expected = 0, found = 0;
};

Seen seen_near(const Eigen::Vector2d& pixel, const std::vector<ExpectedLandmark>& landmarks, double near_px) {
  Seen seen;
  for (const ExpectedLandmark& l : landmarks) {
    if ((l.pixel - pixel).squaredNorm() > near_px * near_px) continue;
    ++seen.expected;
    seen.found += l.found;
  }
  return seen;
}

// Share of found landmarks where the object is visible, however much of it is occluded: median over the
// neighbourhoods of found landmarks.
double usual_share(const std::vector<ExpectedLandmark>& landmarks, double near_px) {
  std::vector<double> shares;
  for (const ExpectedLandmark& l : landmarks) {
    if (!l.found) continue;
    const Seen seen = seen_near(l.pixel, landmarks, near_px);
    if (seen.expected > 1) shares.push_back((seen.found - 1.0) / (seen.expected - 1.0));
  }
  return shares.empty() ? 0 : median(std::move(shares));
}

// Whether at least one landmark fewer than the limit is found. By chance that happens at one place in
// fourteen where nearly three are usual, in one of thirty where more than five are.
bool is_hidden(const Seen& seen, double usual) {
  return seen.found + 1 <= kOcclusion.min_of_usual * usual * seen.expected;
}

}  // namespace

std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  double scale, bool is_mask_given) {
  const double near_px = kOcclusion.near_px * scale;
  const double usual = is_mask_given ? usual_share(landmarks, near_px) : 0;
  std::vector<char> flags(image.size());
  for (int i = 0; i < image.size(); ++i) {
    const Seen seen = seen_near(image.set.features[i].pixel.cast<double>(), landmarks, near_px);
    flags[i] = is_mask_given ? !is_hidden(seen, usual)
                             : seen.found > 0 && seen.found >= kOcclusion.min_found * seen.expected;
  }
  return flags;
}

void exclude_occluders(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map,
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
  candidate->frame.image = select_features(image, flags);
  for (FrameObservation& o : candidate->observations) o.feature = new_index[o.feature];
}

}  // namespace mono_pose_tracker
