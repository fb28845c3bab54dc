#include "cross_view_matcher.h"

#include <algorithm>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

namespace {

constexpr CrossViewOptions kCrossView{};

// Whether the keyframe shows the place of the candidates: at least as many inliers as a registered frame
// needs, and half of all candidates. An aliased place has neither.
bool is_same_place(const MapperOptions& options, const AbsolutePoseReport& pose) {
  return pose.success && pose.num_inliers >= options.min_inliers &&
         2 * pose.num_inliers >= static_cast<int>(pose.inliers.size());
}

// Share of a sample of the first keyframe's landmarks that the second has in view from a similar side.
// Returns 0 early once the share is certainly too small, as for most pairs of a long walk.
double overlap(const Map& map, const Keyframe& first, const std::vector<LandmarkId>& landmarks,
               const Keyframe& second) {
  if (landmarks.empty()) return 0;
  const CameraModel& camera = second.image->camera;
  const Eigen::Vector3d center1 = first.center_in_map(), center2 = second.center_in_map();
  const std::size_t step = std::max<std::size_t>(1, landmarks.size() / kCrossView.sampled_landmarks);
  const double sampled = static_cast<double>((landmarks.size() + step - 1) / step);
  double in_view = sampled;
  for (std::size_t i = 0; i < landmarks.size(); i += step) {
    const Eigen::Vector3d& x_in_map = map.landmark(landmarks[i])->x_in_map;
    Eigen::Vector2d pixel;
    const bool is_seen = (center1 - x_in_map).normalized().dot((center2 - x_in_map).normalized()) >=
                             kCrossView.min_view_cosine &&
                         camera.project(second.camera_from_map * x_in_map, &pixel) && camera.in_image(pixel);
    if (!is_seen && --in_view / sampled < kCrossView.min_overlap) return 0;
  }
  return in_view / sampled;
}

bool is_observed_by(const Map& map, LandmarkId id, KeyframeId by, double max_error_px) {
  const Landmark& landmark = *map.landmark(id);
  return std::any_of(landmark.observations.begin(), landmark.observations.end(), [&](const Observation& o) {
    return o.keyframe == by && error_px(*map.keyframe(by), o.feature, landmark.x_in_map) <= max_error_px;
  });
}

// Shared tracks of two keyframes: features of the second and landmarks of the first, if an absolute pose by
// their verified matches shows that the place is the same (paper, step 4b). Observations that the map already
// has are not among them.
std::vector<SharedTrack> shared_tracks_between(const MapperOptions& options, const Map& map,
                                               const Keyframe& first, const Keyframe& second,
                                               ViewGraph* graph) {
  const int node = graph->add(first.frame_index, first.image),
            other = graph->add(second.frame_index, second.image);
  graph->connect({{node, other}});
  std::vector<SharedTrack> candidates;
  std::vector<Eigen::Vector3d> bearings, points;
  for (const VerifiedMatch& m : graph->verified_matches(node, other)) {
    const LandmarkId landmark = first.landmark_of_feature[m.first];
    if (landmark == kNoLandmark) continue;
    candidates.push_back({landmark, first.id, second.id, m.second});
    bearings.push_back(second.image->set.bearings[m.second]);
    points.push_back(map.landmark(landmark)->x_in_map);
  }
  const AbsolutePoseReport pose =
      estimate_absolute_pose(bearings, points, AbsolutePoseOptions::in_growing_map(options.ransac));
  std::vector<SharedTrack> tracks;
  if (!is_same_place(options, pose)) return tracks;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const SharedTrack& track = candidates[i];
    if (pose.inliers[i] && second.landmark_of_feature[track.feature] != track.landmark)
      tracks.push_back(track);
  }
  return tracks;
}

}  // namespace

KeyframePairs overlapping_pairs(const BundleOptions& options, const Map& map, KeyframeId newer_than) {
  KeyframePairs pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (options.is_cancelled()) return {};
    const std::vector<LandmarkId> landmarks = landmarks_of(keyframe);
    std::vector<std::pair<double, KeyframeId>> overlapping;
    for (const auto& [other_id, other] : map.keyframes()) {
      if (other_id <= std::max(id, newer_than)) continue;
      const double share = overlap(map, keyframe, landmarks, other);
      if (share < kCrossView.min_overlap) continue;
      // A tenth of the landmarks in common connects two keyframes well enough.
      if (10 * map.shared(id, other_id) > static_cast<int>(landmarks.size())) continue;
      overlapping.emplace_back(-share, other_id);
    }
    std::sort(overlapping.begin(), overlapping.end());
    if (overlapping.size() > kCrossView.pairs_per_keyframe) overlapping.resize(kCrossView.pairs_per_keyframe);
    for (const auto& entry : overlapping) pairs.emplace_back(id, entry.second);
  }
  return pairs;
}

std::vector<SharedTrack> match_across_views(const MapperOptions& options, const KeyframePairs& pairs,
                                            ViewGraph* graph, Map* map) {
  std::vector<SharedTrack> all;
  for (const auto& [first, second] : pairs) {
    if (options.bundle.is_cancelled()) break;
    const std::vector<SharedTrack> tracks =
        shared_tracks_between(options, *map, *map->keyframe(first), *map->keyframe(second), graph);
    merge_tracks(tracks, map);
    all.insert(all.end(), tracks.begin(), tracks.end());
  }
  return all;
}

std::set<KeyframeId> with_inconsistent_tracks(const std::vector<SharedTrack>& tracks, const Map& map,
                                              double max_error_px) {
  std::map<KeyframeId, int> balance;  // inconsistent minus consistent tracks
  for (const SharedTrack& track : tracks) {
    const LandmarkId l = map.keyframe(track.keyframe)->landmark_of_feature[track.feature];
    const bool holds = l != kNoLandmark && is_observed_by(map, l, track.keyframe, max_error_px) &&
                       is_observed_by(map, l, track.seen_by, max_error_px);
    balance[track.keyframe] += holds ? -1 : 1;
  }
  std::set<KeyframeId> loose;
  for (const auto& [id, more_are_off] : balance) {
    if (more_are_off >= 0) loose.insert(id);
  }
  return loose;
}

void merge_tracks(const std::vector<SharedTrack>& tracks, Map* map) {
  for (const SharedTrack& track : tracks) {
    const Keyframe* keyframe = map->keyframe(track.keyframe);
    if (!keyframe) continue;
    const LandmarkId held = keyframe->landmark_of_feature[track.feature];
    if (held == kNoLandmark) {
      map->add_observation(track.landmark, track.keyframe, track.feature);
    } else {
      map->merge_landmarks(track.landmark, held);
    }
  }
}

}  // namespace mono_pose_tracker
