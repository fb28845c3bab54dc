#include "mono_pose_tracker/mapping/still_landmarks.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "alike_feature.h"
#include "fixed_in_image.h"
#include "keyframe_landmarks.h"
#include "match_shift.h"
#include "mono_pose_tracker/camera/image_scale.h"
#include "mono_pose_tracker/camera/same_camera.h"
#include "mono_pose_tracker/common/count_deviations.h"
#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/common/parallel.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px (image_scale): three times as far as what counts as its own place, so that noise and a young
// pose can't bring it there.
constexpr double kPlainlyPx = 3 * kSamePlacePx;

// Later keyframes that are tried, for one in which all lies plainly elsewhere: at the end of a recording
// nothing may move any more.
constexpr std::ptrdiff_t kTried = 50;
constexpr std::size_t kLeastInView = 15;  // of the landmarks, to tell how far they should have moved

bool is_of_same_camera(const Keyframe& a, const Keyframe& b) {
  return is_same_camera(a.image->camera.parameters(), b.image->camera.parameters());
}

// px at 640 px; nothing of what the second can't see.
std::optional<double> shift_by_map(const Map& map, const Keyframe& first, int feature,
                                   const Keyframe& second) {
  const Landmark* landmark = map.landmark(first.landmark_of_feature[feature]);
  if (!landmark) return std::nullopt;
  const CameraModel& camera = first.image->camera;
  Eigen::Vector2d here, there;
  if (!camera.project(first.camera_from_map * landmark->x_in_map, &here) ||
      !camera.project(second.camera_from_map * landmark->x_in_map, &there) || !camera.in_image(there)) {
    return std::nullopt;
  }
  return (there - here).norm() / image_scale(camera);
}

bool has_moved_plainly(const Map& map, const Keyframe& first, const Keyframe& second) {
  std::vector<double> shifts;
  for (int f = 0; f < first.image->size(); ++f) {
    if (const auto shift = shift_by_map(map, first, f, second)) shifts.push_back(*shift);
  }
  return shifts.size() >= kLeastInView && median(std::move(shifts)) > kPlainlyPx;
}

StillLandmarks compare(const Map& map, const Keyframe& first, const Keyframe& second,
                       const std::vector<Match>& matches) {
  const double limit_px = kSamePlacePx * image_scale(second.image->camera);
  StillLandmarks result;
  for (const Match& m : matches) {
    const auto shift = shift_by_map(map, first, m.first, second);
    if (!shift || *shift <= kPlainlyPx) continue;
    ++result.matches;
    if (shift_px(*first.image, *second.image, m) >= kSamePlacePx) continue;
    const Landmark& landmark = *map.landmark(first.landmark_of_feature[m.first]);
    result.still += !is_there_too(*second.image, first.image->set.descriptor(m.first),
                                  second.camera_from_map * landmark.x_in_map, limit_px);
  }
  return result;
}

}  // namespace

bool StillLandmarks::is_significant() const {
  return still >= kMinStill && share() >= kMostOfARightMap &&
         deviations_above(kOfARightMap, still, matches) >= kDeviations;
}

StillLandmarks still_landmarks(const Map& map, const MatchesInTime& matches, const MatchOptions& matching,
                               int threads) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  std::vector<StillLandmarks> pairs(in_time.size());
  parallel_for(static_cast<int>(in_time.size()), threads, [&](int i) {
    const auto first = in_time.begin() + i, next = first + 1;
    const auto end = next + std::min(kTried, in_time.end() - next);
    const auto second = std::find_if(next, end, [&](const Keyframe* later) {
      return is_of_same_camera(**first, *later) && has_moved_plainly(map, **first, *later);
    });
    if (second == end) return;
    pairs[i] = compare(map, **first, **second,
                       second == next ? matches[i]
                                      : match_descriptors((*first)->image->set.descriptors,
                                                          (*second)->image->set.descriptors, matching));
  });
  StillLandmarks sum;
  for (const StillLandmarks& pair : pairs) {
    sum.matches += pair.matches;
    sum.still += pair.still;
  }
  return sum;
}

}  // namespace mono_pose_tracker
