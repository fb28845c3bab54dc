#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "map/tracking_map.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

// The observation of a point by a feature of the keyframe.
inline ObservedPoint observed_point(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map) {
  const Rigid3 map_from_camera = keyframe.camera_from_map.inverse();
  ObservedPoint observation;
  observation.x = x_in_map;
  observation.center = map_from_camera.translation;
  observation.bearing = map_from_camera.rotation * keyframe.image->set.bearings[feature];
  return observation;
}

// The observation of a point of the other map. is_of_a: the keyframe is of map a.
inline RayToPoint ray_to_point(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_other,
                               bool is_of_a) {
  const ObservedPoint observation = observed_point(keyframe, feature, x_in_other);
  return {is_of_a, static_cast<int>(keyframe.id), observation.center, observation.bearing, x_in_other};
}

struct OrientationFlipOptions {
  double bend = 0.02;             // share of a distance by which a map may be bent between two of its views,
                                  // however well each point is known
  double min_flip = 5 * kDegree;  // rad, between the two orientations
};

// Resolves an orientation flip between two maps that view one planar patch: rays leave two orientations of it
// open, 10 to 33 degrees apart for strips of a wall, and the angular error may favour the wrong one, as the
// depth uncertainty of each map is lateral for the other. Returns the given similarity or, where it is
// flipped, the one that the covariances of both maps favour; nothing where the points leave it open. With
// fewer inliers than min_inliers they decide nothing. depth_sigma of the observations: prior uncertainty up
// to a common factor.
std::optional<Sim3> resolve_flip(const std::vector<SimilarityMatch>& observations,
                                 const SimilarityOptions& options, const Sim3& found, int min_inliers);

struct MapJoinerOptions {
  double known_depth_px = 4.2;      // px of parallax at 640 px (image_scale) at which features with 0.6 px
  double known_depth_sigma = 0.2;   // noise determine a depth to this share
  double max_disagreement_px = 12;  // at 640 px (image_scale): drift between the keyframes in either map adds
                                    // to the error of the matches
  // Keyframe pairs that are compared by the view graph.
  std::size_t nearest_pairs = 12;    // in time
  std::size_t asked_keyframes = 40;  // for which similar ones are sought, at most twice as many
  int similar_places = 3;            // of each
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
                                       FoundLandmarks found);

/// By locating keyframes of `map` at a place of the other (a keyframe and those that share landmarks with
/// it). The first of the keyframes and at least one more must be found there. Nothing when they and the
/// keyframes that observe their landmarks do not determine a similarity (estimate_similarity_from_rays).
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map,
                                       const std::vector<KeyframeId>& keyframes, const Map& other,
                                       KeyframeId place);

/// The same from the view graph: by the verified matches between keyframes of the two maps that are near in
/// time or look similar (`places` of the other map).
std::optional<MapAlignment> align_maps(const MapperOptions& options, const Map& map, const Map& other,
                                       const PlaceFinder& places, ViewGraph* graph);

/// Pairs of landmarks of `map` and the other map that are the same by the features that observe both.
std::vector<std::pair<LandmarkId, LandmarkId>> same_landmarks(const Map& map, const FoundLandmarks& found);

/// Two maps in the frame and scale of the older one.
struct JoinedMaps {
  Map map;
  MergedIds added;     // offsets of the newer map's ids
  double scale = 1;    // of the newer one
  bool holds = false;  // at least half of the shared landmarks remain after the adjustment, as for a loop
  int failed_adjustments = 0;
};

/// Merges the common landmarks of two maps, and the keyframes of images that are in both, and adjusts the
/// boundary. newer_in_older: of the newer map (`map` of align_maps) with the older. It does not hold where
/// the older has not enough ids.
JoinedMaps join_maps(const MapperOptions& options, const Map& older, const Map& newer,
                     const MapAlignment& newer_in_older);

}  // namespace mono_pose_tracker
