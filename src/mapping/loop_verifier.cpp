#include "mapping/loop_verifier.h"

#include <limits>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "mapping/keyframe_locator.h"
#include "mapping/map_joiner.h"

namespace mono_pose_tracker {

namespace {

// Drift as a share of the path between the two keyframes; nothing when it exceeds the limit.
std::optional<double> drift_of(const Map& map, const Keyframe& keyframe, const LoopConstraint& loop,
                               const LoopOptions& loops) {
  if (loop.old_from_new.rotation.angularDistance(Eigen::Quaterniond::Identity()) >
      loops.places.max_rotation_drift)
    return std::nullopt;
  const Eigen::Vector3d center = keyframe.center_in_map();
  std::vector<double> distances;
  for (const auto& match : loop.matches)
    distances.push_back((map.landmark(match.first)->x_in_map - center).norm());
  const double path_length = path_length_between(map.keyframes(), *map.keyframe(loop.from), keyframe);
  const double moved = (loop.old_from_new * center - center).norm();
  if (moved > loops.places.max_drift * path_length + loops.max_drift_of_depth * median(std::move(distances)))
    return std::nullopt;
  return path_length > 0 ? moved / path_length : 0;
}

}  // namespace

std::optional<LoopConstraint> verify_loop(const MapperOptions& options, const Map& map,
                                          KeyframeId keyframe_id, KeyframeId place,
                                          const LoopOptions& loops) {
  const Keyframe& keyframe = *map.keyframe(keyframe_id);
  const std::unordered_set<LandmarkId> own(keyframe.landmark_of_feature.begin(),
                                           keyframe.landmark_of_feature.end());
  const Location location = locate(options, map, place, *keyframe.image, own);
  if (!location.found) return std::nullopt;
  const std::optional<MapAlignment> alignment =
      align_maps(options, map, map, {{keyframe_id, {location.matches.begin(), location.matches.end()}}});
  if (!alignment) return std::nullopt;
  LoopConstraint loop;
  loop.from = place;
  loop.to = keyframe_id;
  loop.old_from_new = alignment->other_from_map;
  loop.from_from_to = Sim3(map.keyframe(place)->camera_from_map) * loop.old_from_new *
                      Sim3(keyframe.camera_from_map.inverse());
  loop.matches = same_landmarks(map, alignment->found);
  // A landmark has as many rays as keyframes observe it: these count as one.
  if (static_cast<int>(loop.matches.size()) < options.min_inliers) return std::nullopt;
  loop.support = location.support;
  const std::optional<double> drift = drift_of(map, keyframe, loop, loops);
  if (!drift) return std::nullopt;
  loop.drift = *drift;
  return loop;
}

double loop_disagreement_px(const Map& map, const LoopConstraint& loop, const LoopConstraint& other) {
  const Keyframe* place = map.keyframe(other.from);
  if (!place) return std::numeric_limits<double>::infinity();
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> x_in_camera;
  for (const auto& [in_new, in_old] : other.matches) {
    const Landmark *of_new = map.landmark(in_new), *of_old = map.landmark(in_old);
    if (!of_new || !of_old) continue;
    x_in_camera.emplace_back(place->camera_from_map * of_old->x_in_map,
                             place->camera_from_map * (loop.old_from_new * of_new->x_in_map));
  }
  return disagreement_px(place->image->camera, x_in_camera);
}

}  // namespace mono_pose_tracker
