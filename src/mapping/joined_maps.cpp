#include "mapping/joined_maps.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "keyframe_landmarks.h"
#include "mapping/map_covariances.h"
#include "mapping/track_extender.h"
#include "optimization/map_adjustment.h"
#include "sorted_unique.h"

namespace mono_pose_tracker {

namespace {

// Number of landmarks observed from both sides of the boundary: by keyframes before and from `first_new`.
int points_across(const Map& map, KeyframeId first_new) {
  int count = 0;
  for (const auto& entry : map.landmarks()) {
    const std::vector<Observation>& seen = entry.second.observations;
    count += seen.size() > 1 && seen.front().keyframe < first_new && seen.back().keyframe >= first_new;
  }
  return count;
}

// Keyframes with the same image in both maps: (old map's, new map's).
std::vector<std::pair<KeyframeId, KeyframeId>> same_images(const Map& map, KeyframeId first_new) {
  std::map<std::int64_t, KeyframeId> old_of_frame;
  std::vector<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (id < first_new) {
      old_of_frame[keyframe.frame_index] = id;
      continue;
    }
    const auto old = old_of_frame.find(keyframe.frame_index);
    if (old == old_of_frame.end()) continue;
    // The features differ: the object was masked differently.
    if (map.keyframe(old->second)->image->size() == keyframe.image->size())
      pairs.emplace_back(old->second, id);
  }
  return pairs;
}

// Merges two keyframes of the same image feature by feature; one of them remains.
void unite(KeyframeId old_id, KeyframeId new_id, Map* map) {
  const std::vector<LandmarkId> of_new = map->keyframe(new_id)->landmark_of_feature;
  for (std::size_t f = 0; f < of_new.size(); ++f) {
    if (of_new[f] == kNoLandmark) continue;
    const LandmarkId held = map->keyframe(old_id)->landmark_of_feature[f];
    if (held == kNoLandmark) {
      map->add_observation(of_new[f], old_id, static_cast<int>(f));
    } else {
      map->merge_landmarks(of_new[f], held);
    }
  }
  // Frames relative to the new keyframe take the pose of the old one.
  map->set_pose(new_id, map->keyframe(old_id)->camera_from_map);
  map->remove_keyframe(new_id, old_id);
}

// Adds the newer map to the older one. Returns the keyframes that connect the two.
std::vector<KeyframeId> merge(const Map& newer, const MapAlignment& alignment, JoinedMaps* joined) {
  Map& map = joined->map;
  joined->scale = alignment.other_from_map.scale;
  joined->added = map.merge(newer, alignment.other_from_map);
  for (const auto& [own, theirs] : same_landmarks(newer, alignment.found))
    map.merge_landmarks(own + joined->added.landmarks, theirs);
  std::vector<KeyframeId> boundary;
  for (const auto& [id, matches] : alignment.found) {
    boundary.push_back(id + joined->added.keyframes);
    for (const auto& [feature, landmark] : matches) map.add_observation(landmark, boundary.back(), feature);
  }
  for (const auto& [old_id, new_id] : same_images(map, joined->added.keyframes)) {
    unite(old_id, new_id, &map);
    std::replace(boundary.begin(), boundary.end(), new_id, old_id);
    boundary.push_back(old_id);
  }
  return boundary;
}

// Adjusts with a wide loss first, so that the merged tracks have an effect before anything is culled. Returns
// the number of failed adjustments.
int adjust_boundary(const MapperOptions& options, const std::vector<KeyframeId>& boundary, Map* map) {
  const MappingOptions& mapping = options.mapping;
  std::vector<KeyframeId> window = boundary;
  for (const KeyframeId id : boundary) {
    for (const KeyframeId n : neighbors(*map, id, 2 * mapping.window_keyframes)) window.push_back(n);
  }
  window = sorted_unique(std::move(window));
  const auto adjust = [&](const BundleOptions& bundle) -> int {
    return adjust_keyframes(bundle, window, held_keyframes(mapping.window_keyframes),
                            mapping.window_landmarks, map)
        .failed;
  };
  int failed = adjust(with_wide_loss(options.bundle));
  const FlaggedFeatures none;
  const TrackExtender tracks(options, none, map);
  for (const KeyframeId id : boundary) {
    tracks.extend(id);
    tracks.create_landmarks(id, neighbors(*map, id, mapping.matching_keyframes));
  }
  failed += adjust(options.bundle);
  tracks.cull(map->landmark_ids());
  return failed;
}

}  // namespace

JoinedMaps join_maps(const MapperOptions& options, const Map& older, const Map& newer,
                     const MapAlignment& newer_in_older) {
  JoinedMaps joined;
  if (!older.has_ids_for(newer)) return joined;
  joined.map = older;
  const std::vector<KeyframeId> boundary = merge(newer, newer_in_older, &joined);
  const KeyframeId first_new = joined.added.keyframes;
  const int shared = points_across(joined.map, first_new);
  joined.failed_adjustments = adjust_boundary(options, boundary, &joined.map);
  const bool is_all_shared = joined.map.keyframes().rbegin()->first < first_new;
  joined.holds =
      is_all_shared || points_across(joined.map, first_new) >= std::max(options.min_inliers, shared / 2);
  return joined;
}

}  // namespace mono_pose_tracker
