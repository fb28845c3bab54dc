#pragma once

#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

// The observation of a point by a feature of the keyframe.
template <typename Keyframe>
ObservedPoint observed_point(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map) {
  const Rigid3 map_from_camera = keyframe.camera_from_map.inverse();
  ObservedPoint observation;
  observation.x = x_in_map;
  observation.center = map_from_camera.translation;
  observation.bearing = map_from_camera.rotation * keyframe.image->set.bearings[feature];
  return observation;
}

// The observation of a point of the other map. is_of_a: the keyframe is of map a.
template <typename Keyframe>
RayToPoint ray_to_point(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_other,
                        bool is_of_a) {
  const ObservedPoint observation = observed_point(keyframe, feature, x_in_other);
  return {is_of_a, static_cast<int>(keyframe.id), observation.center, observation.bearing, x_in_other};
}

// Resolves an orientation flip of a similarity that RANSAC found from viewing rays. Rays alone leave two
// orientations of a small planar patch open. The similarity is refined from two initial values, the given one
// and the alignment of the points; the solution with the lower cost is kept, with depths weighted by their
// uncertainty. depth_sigma of the observations: prior uncertainty up to a common factor.
SimilarityReport similarity_from_points(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& by_angles);

// Whether two similarities of the same points differ by an orientation flip of a patch. The two solutions for
// strips of a wall were 10 to 33 degrees apart; bundle adjustment corrects smaller differences.
bool is_flipped(const SimilarityReport& one, const SimilarityReport& other);

// Resolves an orientation flip between two maps that view one planar patch from different sides. The depth
// uncertainty of each map is lateral for the other, so the angular error may favour the flipped solution.
// Returns the given similarity or, where it is flipped, the one that both maps' covariances favour. No
// success where the covariances leave it open.
SimilarityReport resolve_flip_by_depths(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& found);

}  // namespace mono_pose_tracker
