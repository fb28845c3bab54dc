#include "mapping/track_extender.h"

#include <algorithm>
#include <limits>
#include <set>

#include "common/rotation.h"
#include "epipolar_matcher.h"
#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "known_baseline.h"
#include "mapping/projection_matcher.h"

namespace mono_pose_tracker {

void TrackExtender::extend(KeyframeId target, const std::optional<std::vector<LandmarkId>>& landmarks) const {
  const Keyframe& keyframe = *map_.keyframe(target);
  ProjectionMatchOptions guided;
  guided.radius_px = options_.mapping.max_reprojection_px;
  const std::vector<LandmarkCandidate> candidates =
      unobserved_in_view(map_, keyframe, landmarks, guided.radius_px);
  guided.max_distance2 = stored_distance2(options_.mapping.max_descriptor_distance);
  guided.cancelled = options_.ransac.cancelled;
  for (const LandmarkMatch& m :
       match_by_projection(candidates, *keyframe.image, keyframe.camera_from_map, guided)) {
    if (is_flagged(excluded_, target, m.feature)) continue;
    const LandmarkId l = candidates[m.candidate].id;
    const LandmarkId held = keyframe.landmark_of_feature[m.feature];
    if (held == kNoLandmark) {
      map_.add_observation(l, target, m.feature);
    } else if (held != l) {
      const Landmark& a = *map_.landmark(l);
      const Landmark& b = *map_.landmark(held);
      const auto agrees = [&](const Observation& o) {
        return error_px(*map_.keyframe(o.keyframe), o.feature, b.x_in_map) <
               options_.mapping.max_reprojection_px;
      };
      if (std::all_of(a.observations.begin(), a.observations.end(), agrees)) map_.merge_landmarks(l, held);
    }
  }
}

void TrackExtender::create_landmarks(KeyframeId newest, const std::vector<KeyframeId>& near) const {
  EpipolarMatchOptions guided;
  guided.threads = options_.bundle.own_threads;
  guided.max_distance2 = stored_distance2(options_.mapping.max_descriptor_distance);
  guided.cancelled = options_.ransac.cancelled;
  guided.min_ratio = options_.matching.min_ratio;
  for (const KeyframeId n : near) {
    if (options_.bundle.is_cancelled()) return;
    const Keyframe& first = *map_.keyframe(newest);
    const Keyframe& second = *map_.keyframe(n);
    if (!is_baseline_known(map_, first, second)) continue;
    guided.max_error_rad = options_.mapping.max_reprojection_px /
                           std::min(first.image->camera.focal(), second.image->camera.focal());
    const Rigid3 second_from_first = second.camera_from_map * first.camera_from_map.inverse();
    const Rigid3 map_from_first = first.camera_from_map.inverse();
    for (const Match& m : match_along_epipolar_lines(first, second, guided)) {
      if (is_flagged(excluded_, newest, m.first) || is_flagged(excluded_, n, m.second)) continue;
      Eigen::Vector3d x_in_first;
      if (!triangulate_two_views(second_from_first, first.image->set.bearings[m.first],
                                 second.image->set.bearings[m.second], &x_in_first)) {
        continue;
      }
      const Eigen::Vector3d x_in_map = map_from_first * x_in_first;
      if (parallax_angle(x_in_map, first.center_in_map(), second.center_in_map()) <
              options_.mapping.min_parallax_deg * kDegree ||
          error_px(first, m.first, x_in_map) > options_.mapping.max_reprojection_px ||
          error_px(second, m.second, x_in_map) > options_.mapping.max_reprojection_px) {
        continue;
      }
      const LandmarkId l = map_.add_landmark(x_in_map);
      map_.add_observation(l, newest, m.first);
      map_.add_observation(l, n, m.second);
    }
  }
}

void TrackExtender::cull(const std::vector<LandmarkId>& landmarks) const {
  for (const LandmarkId l : landmarks) {
    const Landmark* landmark = map_.landmark(l);
    if (!landmark) continue;
    for (const Observation& o : std::vector<Observation>(landmark->observations)) {
      if (error_px(*map_.keyframe(o.keyframe), o.feature, landmark->x_in_map) >
          options_.mapping.max_reprojection_px) {
        map_.remove_observation(l, o.keyframe);
      }
    }
    // Half the parallax that creation needs: bundle adjustment may move a point a little farther away.
    if (landmark->observations.size() < 2 ||
        !has_parallax(map_, *landmark, 0.5 * options_.mapping.min_parallax_deg * kDegree)) {
      map_.remove_landmark(l);
    }
  }
}

std::optional<std::vector<LandmarkId>> TrackExtender::within_reach(KeyframeId id, std::size_t large_map,
                                                                   const PlaceFinder& places,
                                                                   SimilarKeyframes* known) const {
  const std::size_t keyframes = map_.keyframes().size();
  if (keyframes <= large_map) return std::nullopt;
  const std::vector<KeyframeId> direct = neighbors(map_, id, std::numeric_limits<int>::max());
  if (2 * direct.size() > keyframes) return std::nullopt;
  std::set<KeyframeId> near = {id};
  const auto add_with_neighbors = [&](KeyframeId other) {
    if (!map_.keyframe(other)) return;
    near.insert(other);
    for (const KeyframeId next : neighbors(map_, other, options_.mapping.window_keyframes)) near.insert(next);
  };
  for (const KeyframeId other : direct) add_with_neighbors(other);
  const auto [similar, is_new] = known->emplace(id, std::vector<KeyframeId>());
  if (is_new) similar->second = places.find(map_.keyframe(id)->image->set, kBestPlaces);
  for (const KeyframeId place : similar->second) add_with_neighbors(place);
  return landmarks_observed_by(map_, {near.begin(), near.end()});
}

}  // namespace mono_pose_tracker
