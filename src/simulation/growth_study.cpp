#include "simulation/growth_study.h"

#include <algorithm>
#include <deque>
#include <numeric>
#include <stdexcept>

#include "optimization/map_adjustment.h"
#include "simulation/loop_study.h"
#include "walk_follower.h"

namespace mono_pose_tracker {
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
  Mapper mapper(unadjusted, camera);
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
