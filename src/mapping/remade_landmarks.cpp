#include "mapping/remade_landmarks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "common/angles.h"
#include "descriptor_tracks.h"
#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMinViews = 3;  // two contradict each other in no more than one direction
// px at 640 px (image_scale), from where the poses as they are have it: of a wrong match it is tens, while
// poses that are off by a degree or two displace a right one by several.
constexpr double kWithin = 10;
// Of the loss: first so wide that what disagrees pulls as much as what agrees.
constexpr std::array<double, 3> kWidths = {10, 3, 1};
// The map is left alone where it comes out as it was, within what is known of the turns of an object: its own
// landmarks are more, and their observations more exact.
constexpr double kSame = 0.6 * kDegree;
constexpr int kRemakingIterations = 50;
constexpr double kTolerance = 1e-6;

// Where the poses have the point, from its first and last view; false when one of the views lies too far off.
bool locate(const std::vector<const Keyframe*>& in_time, const FeatureTrack& track,
            Eigen::Vector3d* x_in_map) {
  const Keyframe &first = *in_time[track.front().first], &last = *in_time[track.back().first];
  Eigen::Vector3d x_in_first;
  if (!triangulate_two_views(last.camera_from_map * first.camera_from_map.inverse(),
                             first.image->set.bearings[track.front().second],
                             last.image->set.bearings[track.back().second], &x_in_first)) {
    return false;
  }
  *x_in_map = first.camera_from_map.inverse() * x_in_first;
  return std::all_of(track.begin(), track.end(), [&](const auto& view) {
    const Keyframe& keyframe = *in_time[view.first];
    const Eigen::Vector3d x_in_camera = keyframe.camera_from_map * *x_in_map;
    return keyframe.image->set.bearings[view.second].dot(x_in_camera) > 0 &&
           reprojection_error(*keyframe.image, view.second, x_in_camera).norm() <
               kWithin * image_scale(keyframe.image->camera);
  });
}

struct LocatedTrack {
  FeatureTrack track;
  Eigen::Vector3d x_in_map;
};

std::vector<LocatedTrack> locate_all(const std::vector<const Keyframe*>& in_time,
                                     const FeatureTracks& tracks) {
  std::vector<LocatedTrack> located;
  for (const FeatureTrack& track : tracks.all()) {
    Eigen::Vector3d x_in_map;
    if (track.size() >= kMinViews && locate(in_time, track, &x_in_map)) located.push_back({track, x_in_map});
  }
  return located;
}

bool hold_all(const std::vector<LocatedTrack>& tracks, std::size_t keyframes, int min_landmarks) {
  std::vector<int> seen(keyframes, 0);
  for (const LocatedTrack& t : tracks) {
    for (const auto& view : t.track) ++seen[view.first];
  }
  return std::all_of(seen.begin(), seen.end(), [&](int count) { return count >= min_landmarks; });
}

// The largest of the keyframes' turns from the first one, from one map to the other, rad.
double largest_change(const Map& before, const Map& after) {
  const Rigid3 first_before = before.keyframes().begin()->second.camera_from_map.inverse();
  const Rigid3 first_after = after.keyframes().begin()->second.camera_from_map.inverse();
  double largest = 0;
  for (const auto& [id, keyframe] : before.keyframes()) {
    const Rigid3 turn_before = keyframe.camera_from_map * first_before;
    const Rigid3 turn_after = after.keyframe(id)->camera_from_map * first_after;
    largest = std::max(largest, turn_before.rotation.angularDistance(turn_after.rotation));
  }
  return largest;
}

// The map with these landmarks and no others, adjusted.
Map remade(const Map& map, const std::vector<const Keyframe*>& in_time,
           const std::vector<LocatedTrack>& tracks, const BundleOptions& bundle) {
  Map other = map;
  for (const LandmarkId l : other.landmark_ids()) other.remove_landmark(l);
  for (const LocatedTrack& t : tracks) {
    const LandmarkId l = other.add_landmark(t.x_in_map);
    for (const auto& [k, feature] : t.track) other.add_observation(l, in_time[k]->id, feature);
  }
  BundleOptions widened = bundle;
  widened.max_iterations = kRemakingIterations;
  widened.function_tolerance = kTolerance;
  for (const double width : kWidths) {
    widened.loss_width = width * bundle.loss_width;
    adjust_map(widened, &other);
  }
  return other;
}

}  // namespace

bool remake_landmarks(const BundleOptions& bundle, const MatchOptions& matching, int min_landmarks,
                      const IsLeftOut& is_left_out, Map* map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(*map);
  const std::vector<LocatedTrack> tracks =
      locate_all(in_time, tracks_by_descriptors(in_time, matching, is_left_out, bundle.own_threads));
  if (in_time.empty() || !hold_all(tracks, in_time.size(), min_landmarks)) return false;
  Map other = remade(*map, in_time, tracks, bundle);
  if (largest_change(*map, other) < kSame) return false;
  *map = std::move(other);
  return true;
}

}  // namespace mono_pose_tracker
