#pragma once

#include <optional>
#include <vector>

#include "common/rotation.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"
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
                                 const SimilarityOptions& options, const Sim3& found, int min_inliers,
                                 const OrientationFlipOptions& flip = {});

}  // namespace mono_pose_tracker
