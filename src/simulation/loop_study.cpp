#include "simulation/loop_study.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "mono_pose_tracker/geometry/sim3.h"
#include "optimization/map_adjustment.h"
#include "walk_follower.h"

namespace mono_pose_tracker {
namespace {

Eigen::Vector3d true_center(const FeatureWalk& walk, std::int64_t frame) {
  return walk.camera_from_world.at(frame).inverse().translation;
}

// Keyframes' positions and the truth's, up to a frame.
struct Positions {
  std::vector<Eigen::Vector3d> found, truth;

  template <typename Keyframes>
  Positions(const FeatureWalk& walk, const Keyframes& keyframes, std::int64_t last_frame) {
    for (const auto& [id, keyframe] : keyframes) {
      if (keyframe.frame_index > last_frame) continue;
      found.push_back(keyframe.camera_from_map.inverse().translation);
      truth.push_back(true_center(walk, keyframe.frame_index));
    }
  }
};

double drift_of_newest(const FeatureWalk& walk, const TrackingMap& map) {
  const KeyframeView& newest = map.keyframes.rbegin()->second;
  const Positions first(walk, map.keyframes, newest.frame_index / 3);
  Sim3 truth_from_map;
  if (!align_sim3(first.found, first.truth, &truth_from_map)) return 0;
  const Eigen::Vector3d at = truth_from_map * newest.camera_from_map.inverse().translation;
  const double way = walk.length * static_cast<double>(newest.frame_index) /
                     static_cast<double>(walk.camera_from_world.size() - 1);
  return (at - true_center(walk, newest.frame_index)).norm() / way;
}

template <typename Keyframes>
double position_rmse(const FeatureWalk& walk, const Keyframes& keyframes) {
  const Positions all(walk, keyframes, static_cast<std::int64_t>(walk.camera_from_world.size()));
  Sim3 truth_from_map;
  if (!align_sim3(all.found, all.truth, &truth_from_map)) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < all.found.size(); ++i) {
    sum += (truth_from_map * all.found[i] - all.truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(all.found.size())) / walk.length;
}

// The same of where all that the map's keyframes see would have them, sought from the truth.
double limit_rmse(const FeatureWalk& walk, BundleOptions options, Map map) {
  constexpr int kToTheEnd = 200;  // iterations: it takes up to a hundred
  options.max_iterations = kToTheEnd;
  const Positions all(walk, map.keyframes(), static_cast<std::int64_t>(walk.camera_from_world.size()));
  Sim3 truth_from_map;
  if (!align_sim3(all.found, all.truth, &truth_from_map)) return 0;
  map.transform(truth_from_map);
  std::map<KeyframeId, Rigid3> truth;
  for (const auto& [id, keyframe] : map.keyframes()) {
    truth[id] = walk.camera_from_world.at(static_cast<std::size_t>(keyframe.frame_index));
  }
  for (const auto& [id, camera_from_world] : truth) map.set_pose(id, camera_from_world);
  adjust_map(options, &map);
  return position_rmse(walk, map.keyframes());
}

}  // namespace

LoopStudy run_loop_study(const FeatureWalk& walk, const CameraModel& camera, const TrackerOptions& options,
                         double noise_px, std::uint64_t seed, bool close_loops, bool find_limit) {
  Random random(seed);
  WalkFollower follower(options, camera);
  follower.begin(true_beginning(walk, camera, noise_px, random));
  Mapper& mapper = follower.mapper();
  LoopStudy study;
  study.frames = static_cast<int>(walk.camera_from_world.size());
  study.frames_posed = 2;
  for (int i = 2; i < study.frames; ++i) {
    double start = thread_seconds();
    study.frames_posed += follower.follow(walk_frame(walk, camera, i, noise_px, random));
    study.map_seconds += thread_seconds() - start;
    if (!close_loops) continue;
    const double drift = drift_of_newest(walk, *mapper.tracking_map());
    const std::size_t known = mapper.loops().size();
    start = thread_seconds();
    follower.close_loops();
    const double taken = thread_seconds() - start;
    if (mapper.loops().size() == known) {
      study.search_seconds += taken;
      study.slowest_search_s = std::max(study.slowest_search_s, taken);
    }
    for (std::size_t l = known; l < mapper.loops().size(); ++l) {
      const ClosedLoop& loop = mapper.loops()[l];
      const int from = static_cast<int>(loop.from_frame), to = static_cast<int>(loop.to_frame);
      study.loops.push_back({from, to, (true_center(walk, from) - true_center(walk, to)).norm(), drift,
                             drift_of_newest(walk, *mapper.tracking_map())});
    }
  }
  study.keyframes = static_cast<int>(mapper.map().keyframes().size());
  study.worst_prediction = follower.worst_prediction();
  study.position_rmse = position_rmse(walk, mapper.map().keyframes());
  if (find_limit) study.limit_rmse = limit_rmse(walk, options.mapper(camera.focal()).bundle, mapper.map());
  return study;
}

}  // namespace mono_pose_tracker
