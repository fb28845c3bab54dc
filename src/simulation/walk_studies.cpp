#include "simulation/walk_studies.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <deque>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "mapping/mapper.h"
#include "mapping/mapper_input.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "optimization/map_adjustment.h"
#include "simulation/feature_walk.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {
namespace {

// Follows a walk frame by frame: each frame is registered in the present map (predicted by the last motion)
// and becomes a keyframe.
class WalkFollower {
 public:
  WalkFollower(const TrackerOptions& options, const CameraModel& camera);

  Mapper& mapper() { return mapper_; }
  double worst_prediction() const { return worst_prediction_; }
  double insert_seconds() const { return insert_seconds_; }  // of the last keyframe

  void begin(const InitialMap& initial);
  // False when the frame was not registered.
  bool follow(const Frame& frame);
  void close_loops();

 private:
  FrameRegistrar registrar_;
  Mapper mapper_;
  KeyframeId reference_ = -1;
  Rigid3 motion_;  // camera now from camera one frame ago
  double worst_prediction_ = 0;
  double insert_seconds_ = 0;
};

// What the clock cuts short would not repeat.
MapperOptions unhurried(MapperOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  return options;
}

WalkFollower::WalkFollower(const TrackerOptions& options, const CameraModel& camera)
    : registrar_(options, camera), mapper_(unhurried(options.mapper(camera.focal()))) {}

// CPU time of this thread.
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

namespace {

constexpr double kNoise = 0.5;  // px
constexpr std::size_t kMean = 50;

// A snapshot after what a keyframe may change: the newest one's pose and its landmarks.
double publish_ms(Map map) {
  map.views();
  const Keyframe newest = map.keyframes().rbegin()->second;
  map.set_pose(newest.id, newest.camera_from_map);
  for (const LandmarkId l : newest.landmark_of_feature) {
    if (l != kNoLandmark) map.set_position(l, map.landmark(l)->x_in_map);
  }
  const double start = thread_seconds();
  const MapViews copy = map.views();
  return 1e3 * (thread_seconds() - start);
}

void measure_end(const TrackerOptions& options, const CameraModel& camera, const Map& map, GrowthStep* step) {
  MapperOptions unadjusted = options.mapper(camera.focal());
  unadjusted.bundle.max_seconds = 1e-6;  // no step is made
  Mapper mapper(unadjusted);
  mapper.restore(map, 0);
  double start = thread_seconds();
  mapper.finish();
  step->finish_s = thread_seconds() - start;
  Map adjusted = map;
  BundleOptions bundle = options.bundle;
  start = thread_seconds();
  adjust_map(bundle, &adjusted);
  step->global_adjust_s = thread_seconds() - start;
}

}  // namespace

std::vector<GrowthStep> run_growth_study(const FeatureWalk& walk, const CameraModel& camera,
                                         TrackerOptions options, const std::vector<int>& sizes,
                                         int finish_up_to) {
  options.mapping.redundant_overlap = 1.01;  // none goes
  options.bundle.num_threads = 1;            // so that the thread's CPU time is all
  Random random(options.seed);
  WalkFollower follower(options, camera);
  follower.begin(true_beginning(walk, camera, kNoise, random));
  std::deque<double> last_ms;
  std::vector<GrowthStep> steps;
  for (int i = 2; i < static_cast<int>(walk.camera_from_world.size()) && steps.size() < sizes.size(); ++i) {
    if (!follower.follow(walk_frame(walk, camera, i, kNoise, random))) {
      throw std::runtime_error("frame " + std::to_string(i) + " of the walk was not registered");
    }
    last_ms.push_back(1e3 * follower.insert_seconds());
    if (last_ms.size() > kMean) last_ms.pop_front();
    const Map& map = follower.mapper().map();
    if (static_cast<int>(map.keyframes().size()) < sizes[steps.size()]) continue;
    GrowthStep step;
    step.keyframes = static_cast<int>(map.keyframes().size());
    step.landmarks = static_cast<int>(map.landmarks().size());
    step.keyframe_ms =
        std::accumulate(last_ms.begin(), last_ms.end(), 0.0) / static_cast<double>(last_ms.size());
    step.publish_ms = publish_ms(map);
    if (step.keyframes <= finish_up_to) measure_end(options, camera, map, &step);
    steps.push_back(step);
  }
  return steps;
}

}  // namespace mono_pose_tracker
