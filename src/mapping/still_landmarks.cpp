#include "mono_pose_tracker/mapping/still_landmarks.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "fixed_in_image.h"
#include "keyframe_landmarks.h"
#include "match_shift.h"
#include "mono_pose_tracker/camera/image_scale.h"
#include "mono_pose_tracker/common/count_deviations.h"
#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/common/parallel.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px (image_scale): three times as far as what counts as its own place, so that noise and a young
// pose can't bring it there.
constexpr double kPlainlyPx = 3 * kSamePlacePx;

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
  return !shifts.empty() && median(std::move(shifts)) > kPlainlyPx;
}

StillLandmarks compare(const Map& map, const Keyframe& first, const Keyframe& second,
                       const std::vector<Match>& matches) {
  StillLandmarks result;
  for (const Match& m : matches) {
    const auto shift = shift_by_map(map, first, m.first, second);
    if (!shift || *shift <= kPlainlyPx) continue;
    ++result.matches;
    result.still += shift_px(*first.image, *second.image, m) < kSamePlacePx;
  }
  return result;
}

}  // namespace

bool StillLandmarks::is_significant() const {
  return still >= kMinStill && share() >= kMostOfARightMap &&
         deviations_above(kOfARightMap, still, matches) >= kDeviations;
}

StillLandmarks still_landmarks(const Map& map, const MatchOptions& matching, int threads) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  std::vector<StillLandmarks> pairs(in_time.size());
  parallel_for(static_cast<int>(in_time.size()), threads, [&](int i) {
    const auto first = in_time.begin() + i;
    const auto second = std::find_if(std::next(first), in_time.end(), [&](const Keyframe* later) {
      return has_moved_plainly(map, **first, *later);
    });
    if (second == in_time.end()) return;
    pairs[i] = compare(
        map, **first, **second,
        match_descriptors((*first)->image->set.descriptors, (*second)->image->set.descriptors, matching));
  });
  StillLandmarks sum;
  for (const StillLandmarks& pair : pairs) {
    sum.matches += pair.matches;
    sum.still += pair.still;
  }
  return sum;
}

}  // namespace mono_pose_tracker
