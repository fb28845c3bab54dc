#include "mono_pose_tracker/mapping/contradiction.h"

#include <algorithm>
#include <vector>

#include "mono_pose_tracker/features/matching.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px width or less: beyond what noise, a lens model and the drift of a young pose leave over.
constexpr double kElsewhere = 6;
// Fewer matches, or fewer that contradict, are chance: a repeated texture gives several wrong ones at once.
constexpr int kMinMatches = 30, kMinContradicting = 8;

Contradiction compare(const Map& map, const Keyframe& first, const Keyframe& second,
                      const MatchOptions& matching, double limit_px) {
  Contradiction result;
  result.frame_index = second.frame_index;
  for (const Match& m :
       match_descriptors(first.image->set.descriptors, second.image->set.descriptors, matching)) {
    const Landmark* landmark = map.landmark(first.landmark_of_feature[m.first]);
    if (!landmark) continue;
    ++result.matches;
    const Eigen::Vector3d x_in_second = second.camera_from_map * landmark->x_in_map;
    result.contradicting += x_in_second.dot(second.image->set.bearings[m.second]) <= 0 ||
                            reprojection_error(*second.image, m.second, x_in_second).norm() > limit_px;
  }
  return result;
}

}  // namespace

Contradiction worst_contradiction(const Map& map, const MatchOptions& matching, int image_width) {
  std::vector<const Keyframe*> in_time;
  for (const auto& entry : map.keyframes()) in_time.push_back(&entry.second);
  std::sort(in_time.begin(), in_time.end(),
            [](const Keyframe* a, const Keyframe* b) { return a->frame_index < b->frame_index; });
  const double limit_px = kElsewhere * std::max(1.0, image_width / 640.0);
  Contradiction worst;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    const Contradiction here = compare(map, *in_time[i], *in_time[i + 1], matching, limit_px);
    if (here.matches < kMinMatches || here.contradicting < kMinContradicting) continue;
    if (here.share() > worst.share()) worst = here;
  }
  return worst;
}

}  // namespace mono_pose_tracker
