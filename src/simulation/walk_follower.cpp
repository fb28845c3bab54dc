#include "walk_follower.h"

#include <algorithm>
#include <ctime>
#include <limits>
#include <optional>

#include "simulation/loop_study.h"

namespace mono_pose_tracker {

namespace {

// What the clock cuts short would not repeat.
MapperOptions unhurried(MapperOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  return options;
}

}  // namespace

WalkFollower::WalkFollower(const TrackerOptions& options, const CameraModel& camera)
    : registrar_(options, camera), mapper_(unhurried(options.mapper(camera.focal())), camera) {}

double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void WalkFollower::begin(const InitialMap& initial) {
  mapper_.initialize(initial, 0);
  const TrackingMap& map = *mapper_.tracking_map();
  reference_ = map.keyframes.rbegin()->first;
  motion_ = map.keyframes.rbegin()->second.camera_from_map *
            map.keyframes.begin()->second.camera_from_map.inverse();
}

bool WalkFollower::follow(const Frame& frame) {
  const TrackingMapPtr map = mapper_.tracking_map();
  Rigid3 last;
  if (!map->camera_from_map(reference_, &last)) return false;
  const KeyframeId reference = map->keyframes.count(reference_) ? reference_ : map->keyframes.rbegin()->first;
  const RegistrationReport pose = registrar_.register_frame(frame, *map, reference, motion_ * last);
  if (!pose.success) return false;
  KeyframeCandidate candidate{
      map->map_id,       frame,
      reference,         pose.camera_from_map * map->keyframes.at(reference).camera_from_map.inverse(),
      pose.observations, map->corrections.size()};
  const Eigen::Vector3d expected = (motion_ * last).inverse().translation;
  const double step = motion_.translation.norm();
  const double off = (pose.camera_from_map.inverse().translation - expected).norm();
  if (step > 0) worst_prediction_ = std::max(worst_prediction_, off / step);
  const double start = thread_seconds();
  mapper_.insert(candidate);
  insert_seconds_ = thread_seconds() - start;
  const auto& keyframes = mapper_.tracking_map()->keyframes;
  if (keyframes.rbegin()->second.frame_index == frame.index) {
    reference_ = keyframes.rbegin()->first;
    motion_ = keyframes.rbegin()->second.camera_from_map * last.inverse();
  }
  return true;
}

void WalkFollower::close_loops() {
  const std::size_t before = mapper_.tracking_map()->corrections.size();
  mapper_.seek_loop();
  for (BackgroundJob aside = mapper_.take_background_job(); aside; aside = mapper_.take_background_job()) {
    aside([] { return false; })(mapper_);
  }
  const MapCorrections& corrections = mapper_.tracking_map()->corrections;
  for (std::size_t i = before; i < corrections.size(); ++i) {
    motion_.translation *= corrections[i]->length_scale(reference_);
  }
}

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

}  // namespace mono_pose_tracker
