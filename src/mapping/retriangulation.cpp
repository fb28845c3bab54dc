#include "mapping/retriangulation.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

namespace {

constexpr RetriangulationOptions kRetriangulation{};

// The view of the track whose ray makes the largest angle with this one's.
std::size_t widest_from(std::size_t view, const std::vector<const Keyframe*>& in_time,
                        const FeatureTrack& track) {
  const auto ray = [&](std::size_t i) {
    const Keyframe& keyframe = *in_time[track[i].first];
    return (keyframe.camera_from_map.rotation.conjugate() * keyframe.image->set.bearings[track[i].second])
        .eval();
  };
  const Eigen::Vector3d of_view = ray(view);
  std::size_t widest = view;
  double least_cosine = 2;
  for (std::size_t i = 0; i < track.size(); ++i) {
    const double cosine = i == view ? 2 : of_view.dot(ray(i));
    if (cosine < least_cosine) least_cosine = cosine, widest = i;
  }
  return widest;
}

// Triangulates the point from two views far apart; false when a view has too large an error.
bool locate(const std::vector<const Keyframe*>& in_time, const FeatureTrack& track,
            Eigen::Vector3d* x_in_map) {
  const std::size_t one = widest_from(0, in_time, track), other = widest_from(one, in_time, track);
  const Keyframe &first = *in_time[track[one].first], &last = *in_time[track[other].first];
  Eigen::Vector3d x_in_first;
  if (!triangulate_two_views(last.camera_from_map * first.camera_from_map.inverse(),
                             first.image->set.bearings[track[one].second],
                             last.image->set.bearings[track[other].second], &x_in_first)) {
    return false;
  }
  *x_in_map = first.camera_from_map.inverse() * x_in_first;
  return std::all_of(track.begin(), track.end(), [&](const auto& view) {
    const Keyframe& keyframe = *in_time[view.first];
    const Eigen::Vector3d x_in_camera = keyframe.camera_from_map * *x_in_map;
    return keyframe.image->set.bearings[view.second].dot(x_in_camera) > 0 &&
           reprojection_error(*keyframe.image, view.second, x_in_camera).norm() <
               kRetriangulation.max_error_px * image_scale(keyframe.image->camera);
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
    if (track.size() >= kRetriangulation.min_views && locate(in_time, track, &x_in_map))
      located.push_back({track, x_in_map});
  }
  return located;
}

// Keyframes that too few of the tracks constrain.
std::set<KeyframeId> weak_keyframes(const std::vector<const Keyframe*>& in_time,
                                    const std::vector<LocatedTrack>& tracks, int min_landmarks) {
  std::vector<int> count(in_time.size(), 0);
  for (const LocatedTrack& t : tracks) {
    for (const auto& view : t.track) ++count[view.first];
  }
  std::set<KeyframeId> weak;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    if (count[k] < min_landmarks) weak.insert(in_time[k]->id);
  }
  return weak;
}

// The landmark with more than half of its observations on the track. Two tracks cannot have the same one.
LandmarkId landmark_of(const Map& map, const std::vector<const Keyframe*>& in_time,
                       const FeatureTrack& track) {
  std::map<LandmarkId, int> votes;
  for (const auto& [k, feature] : track) {
    const LandmarkId id = map.keyframe(in_time[k]->id)->landmark_of_feature[feature];
    if (id != kNoLandmark) ++votes[id];
  }
  const auto most = std::max_element(votes.begin(), votes.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == votes.end()) return kNoLandmark;
  const auto observations = static_cast<int>(map.landmark(most->first)->observations.size());
  return 2 * most->second > observations ? most->first : kNoLandmark;
}

}  // namespace

FeatureTracks graph_tracks(const Map& map, const std::vector<EdgeConsistency>& edges, const ViewGraph& graph,
                           const IsExcluded& is_excluded) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  const std::map<KeyframeId, int> place = places_in_time(in_time);
  std::vector<int> features;
  for (const Keyframe* keyframe : in_time) features.push_back(keyframe->image->size());
  std::vector<const EdgeConsistency*> strongest_first;
  for (const EdgeConsistency& edge : edges) {
    if (2 * edge.explained >= edge.matches) strongest_first.push_back(&edge);
  }
  std::stable_sort(strongest_first.begin(), strongest_first.end(),
                   [](const auto* a, const auto* b) { return a->matches > b->matches; });
  FeatureTracks tracks(features);
  for (const EdgeConsistency* edge : strongest_first) {
    const TwoViewGeometry& geometry = *graph.edge(edge->pair.first, edge->pair.second);
    for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
      const Match& m = geometry.matches[i];
      if (geometry.motion_of_match[i] != edge->motion || is_excluded(edge->first, m.first) ||
          is_excluded(edge->second, m.second)) {
        continue;
      }
      tracks.join(place.at(edge->first), m.first, place.at(edge->second), m.second);
    }
  }
  return tracks;
}

void replace_landmarks(const FeatureTracks& tracks, int min_landmarks, Map* map) {
  Map other = *map;
  const std::vector<const Keyframe*> in_time = keyframes_in_time(*map);
  const std::vector<LocatedTrack> located = locate_all(in_time, tracks);
  const std::set<KeyframeId> weak = weak_keyframes(in_time, located, min_landmarks);
  // Images between the keyframes refer to landmarks by their ids.
  for (const LandmarkId id : other.landmark_ids()) {
    const std::vector<Observation> observations = other.landmark(id)->observations;
    const bool is_of_weak = std::any_of(observations.begin(), observations.end(),
                                        [&](const Observation& o) { return weak.count(o.keyframe) > 0; });
    if (is_of_weak) continue;
    for (const Observation& o : observations) other.remove_observation(id, o.keyframe);
  }
  for (const LocatedTrack& t : located) {
    LandmarkId l = landmark_of(*map, in_time, t.track);
    if (l == kNoLandmark || !other.landmark(l)->observations.empty()) l = other.add_landmark(t.x_in_map);
    other.set_position(l, t.x_in_map);
    for (const auto& [k, feature] : t.track) {
      if (other.keyframe(in_time[k]->id)->landmark_of_feature[feature] == kNoLandmark)
        other.add_observation(l, in_time[k]->id, feature);
    }
  }
  for (const LandmarkId id : other.landmark_ids()) {
    if (other.landmark(id)->observations.size() < 2) other.remove_landmark(id);
  }
  *map = std::move(other);
}

}  // namespace mono_pose_tracker
