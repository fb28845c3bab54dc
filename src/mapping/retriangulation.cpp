#include "mapping/retriangulation.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "feature_tracks.h"
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
constexpr int kWideIterations = 50;
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

// The connected components of the verified matches, those of the nearest keyframes joined first.
FeatureTracks tracks_of(const std::vector<const Keyframe*>& in_time, const ViewGraph& graph,
                        std::vector<EdgeConsistency> edges, const IsLeftOut& is_left_out) {
  std::map<KeyframeId, int> place;
  std::vector<int> features;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    place[in_time[k]->id] = static_cast<int>(k);
    features.push_back(in_time[k]->image->size());
  }
  const auto apart = [&](const EdgeConsistency& e) {
    return std::abs(place.at(e.first) - place.at(e.second));
  };
  std::stable_sort(edges.begin(), edges.end(),
                   [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
  FeatureTracks tracks(features);
  for (const EdgeConsistency& edge : edges) {
    if (edge.is_inconsistent) continue;
    const TwoViewGeometry& geometry = *graph.edge(edge.pair.first, edge.pair.second);
    for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
      const Match& m = geometry.matches[i];
      if (geometry.motion_of_match[i] != edge.motion || is_left_out(edge.first, m.first) ||
          is_left_out(edge.second, m.second))
        continue;
      tracks.join(place.at(edge.first), m.first, place.at(edge.second), m.second);
    }
  }
  return tracks;
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

// The map with these landmarks and no others, adjusted.
Map with_landmarks(const Map& map, const std::vector<const Keyframe*>& in_time,
                   const std::vector<LocatedTrack>& tracks, const BundleOptions& bundle) {
  Map other = map;
  for (const LandmarkId l : other.landmark_ids()) other.remove_landmark(l);
  for (const LocatedTrack& t : tracks) {
    const LandmarkId l = other.add_landmark(t.x_in_map);
    for (const auto& [k, feature] : t.track) other.add_observation(l, in_time[k]->id, feature);
  }
  BundleOptions widened = bundle;
  widened.max_iterations = kWideIterations;
  widened.function_tolerance = kTolerance;
  for (const double width : kWidths) {
    widened.loss_width = width * bundle.loss_width;
    adjust_map(widened, &other);
  }
  return other;
}

}  // namespace

bool retriangulate(const BundleOptions& bundle, const ViewGraph& graph,
                   const std::vector<EdgeConsistency>& edges, const IsLeftOut& is_left_out, int min_landmarks,
                   Map* map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(*map);
  if (in_time.empty()) return false;
  const std::vector<LocatedTrack> tracks = locate_all(in_time, tracks_of(in_time, graph, edges, is_left_out));
  if (!hold_all(tracks, in_time.size(), min_landmarks)) return false;
  *map = with_landmarks(*map, in_time, tracks, bundle);
  return true;
}

}  // namespace mono_pose_tracker
