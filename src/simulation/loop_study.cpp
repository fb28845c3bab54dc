#include "mono_pose_tracker/simulation/loop_study.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>

#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/mapping/mapper.h"
#include "mono_pose_tracker/tracking/resector.h"

namespace mono_pose_tracker {
namespace {

double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Eigen::Vector3d true_center(const FeatureWalk& walk, std::int64_t frame) {
  return walk.camera_from_world.at(frame).inverse().translation;
}

// Keyframes' positions and the truth's, up to a frame.
struct Positions {
  std::vector<Eigen::Vector3d> found, truth;

  Positions(const FeatureWalk& walk, const TrackingMap& map, std::int64_t last_frame) {
    for (const auto& [id, keyframe] : map.keyframes) {
      if (keyframe.frame_index > last_frame) continue;
      found.push_back(keyframe.camera_from_map.inverse().translation);
      truth.push_back(true_center(walk, keyframe.frame_index));
    }
  }
};

double drift_of_newest(const FeatureWalk& walk, const TrackingMap& map) {
  const KeyframeView& newest = map.keyframes.rbegin()->second;
  const Positions first(walk, map, newest.frame_index / 3);
  Sim3 truth_from_map;
  if (!align_sim3(first.found, first.truth, &truth_from_map)) return 0;
  const Eigen::Vector3d at = truth_from_map * newest.camera_from_map.inverse().translation;
  const double way = walk.length * static_cast<double>(newest.frame_index) /
                     static_cast<double>(walk.camera_from_world.size() - 1);
  return (at - true_center(walk, newest.frame_index)).norm() / way;
}

double position_rmse(const FeatureWalk& walk, const TrackingMap& map) {
  const Positions all(walk, map, static_cast<std::int64_t>(walk.camera_from_world.size()));
  Sim3 truth_from_map;
  if (!align_sim3(all.found, all.truth, &truth_from_map)) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < all.found.size(); ++i) {
    sum += (truth_from_map * all.found[i] - all.truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(all.found.size())) / walk.length;
}

// The camera that is followed through the walk, frame by frame.
class Follower {
 public:
  Follower(const TrackerOptions& options, const CameraModel& camera)
      : resector_(options, camera), mapper_(options.mapper(camera.focal()), camera) {}

  Mapper& mapper() { return mapper_; }
  double worst_prediction() const { return worst_prediction_; }

  void begin(const InitialMap& initial) {
    mapper_.initialize(initial, 0);
    const TrackingMap& map = *mapper_.tracking_map();
    reference_ = map.keyframes.rbegin()->first;
    motion_ = map.keyframes.rbegin()->second.camera_from_map *
              map.keyframes.begin()->second.camera_from_map.inverse();
  }

  // False when the frame was not posed.
  bool follow(const Frame& frame) {
    const TrackingMapPtr map = mapper_.tracking_map();
    Rigid3 last;
    if (!map->camera_from_map(reference_, &last)) return false;
    const KeyframeId reference =
        map->keyframes.count(reference_) ? reference_ : map->keyframes.rbegin()->first;
    const ResectionReport pose = resector_.resect(frame, *map, reference, motion_ * last);
    if (!pose.success) return false;
    KeyframeCandidate candidate{frame, reference,
                                pose.camera_from_map * map->keyframes.at(reference).camera_from_map.inverse(),
                                pose.observations, map->corrections.size()};
    const Eigen::Vector3d expected = (motion_ * last).inverse().translation;
    const double step = motion_.translation.norm();
    const double off = (pose.camera_from_map.inverse().translation - expected).norm();
    if (step > 0) worst_prediction_ = std::max(worst_prediction_, off / step);
    mapper_.insert(candidate);
    const auto& keyframes = mapper_.tracking_map()->keyframes;
    if (keyframes.rbegin()->second.frame_index == frame.index) {
      reference_ = keyframes.rbegin()->first;
      motion_ = keyframes.rbegin()->second.camera_from_map * last.inverse();
    }
    return true;
  }

  void close_loops() {
    const std::size_t before = mapper_.tracking_map()->corrections.size();
    mapper_.seek_loop();
    for (Aside aside = mapper_.take_aside(); aside; aside = mapper_.take_aside()) {
      aside([] { return false; })(mapper_);
    }
    const MapCorrections& corrections = mapper_.tracking_map()->corrections;
    for (std::size_t i = before; i < corrections.size(); ++i) {
      motion_.translation *= corrections[i]->length_scale(reference_);
    }
  }

 private:
  Resector resector_;
  Mapper mapper_;
  KeyframeId reference_ = -1;
  Rigid3 motion_;  // camera now from camera one frame ago
  double worst_prediction_ = 0;
};

}  // namespace

InitialMap true_beginning(const FeatureWalk& walk, const CameraModel& camera, double noise_px,
                          Random& random) {
  InitialMap map;
  std::vector<std::vector<int>> point_of(2);
  for (int v = 0; v < 2; ++v) {
    map.views.push_back({walk_frame(walk, camera, v, noise_px, random, &point_of[v]),
                         walk.camera_from_world[v] * walk.camera_from_world[0].inverse()});
  }
  for (std::size_t f = 0; f < point_of[0].size(); ++f) {
    const auto found = std::find(point_of[1].begin(), point_of[1].end(), point_of[0][f]);
    if (found == point_of[1].end()) continue;
    map.points.push_back({walk.camera_from_world[0] * walk.x_in_world[point_of[0][f]],
                          {{0, static_cast<int>(f)}, {1, static_cast<int>(found - point_of[1].begin())}}});
  }
  return map;
}

LoopStudy run_loop_study(const FeatureWalk& walk, const CameraModel& camera, const TrackerOptions& options,
                         double noise_px, std::uint64_t seed, bool close_loops) {
  Random random(seed);
  Follower follower(options, camera);
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
  study.position_rmse = position_rmse(walk, *mapper.tracking_map());
  return study;
}

}  // namespace mono_pose_tracker
