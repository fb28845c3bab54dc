#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/orientation_flip.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

struct MapJoinerOptions {
  double known_depth_px = 4.2;      // px of parallax at 640 px (image_scale) at which features with 0.6 px
  double known_depth_sigma = 0.2;   // noise determine a depth to this share
  double max_disagreement_px = 12;  // at 640 px (image_scale): drift between the keyframes in either map adds
                                    // to the error of the matches
  // Keyframe pairs that are compared by the view graph.
  std::size_t nearest_pairs = 12;    // in time
  std::size_t asked_keyframes = 40;  // for which similar ones are sought, at most twice as many
  int similar_places = 3;            // of each
  OrientationFlipOptions flip;
};

/// Landmarks of another map that keyframes of a map observe: by keyframe, (feature, landmark).
using FoundLandmarks = std::map<KeyframeId, std::map<int, LandmarkId>>;

/// The similarity of two maps, and the landmarks of each in keyframes of the other that agree with it.
struct MapAlignment {
  Sim3 other_from_map;
  FoundLandmarks found, found_in_other;  // by keyframes of the map; by those of the other

  MapAlignment inverse() const { return {other_from_map.inverse(), found_in_other, found}; }
};

/// By landmarks of the other map that keyframes of `map` observe, and all keyframes that observe the same
/// landmarks. Nothing where these do not determine a similarity (estimate_similarity_from_rays). The two may
/// be one map, where it has some landmarks twice.
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       FoundLandmarks found, const MapJoinerOptions& joiner = {});

/// By locating keyframes of `map` at a place of the other (a keyframe and those that share landmarks with
/// it). The first of the keyframes and at least one more must be found there. Nothing when they and the
/// keyframes that observe their landmarks do not determine a similarity (estimate_similarity_from_rays).
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map,
                                       const std::vector<KeyframeId>& keyframes, const Map& other,
                                       KeyframeId place, const MapJoinerOptions& joiner = {});

/// The same from the view graph: by the verified matches between keyframes of the two maps that are near in
/// time or look similar (`places` of the other map).
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph,
                                       const MapJoinerOptions& joiner = {});

/// Pairs of landmarks of `map` and the other map that are the same by the features that observe both.
std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map, const FoundLandmarks& found);

}  // namespace mono_pose_tracker
