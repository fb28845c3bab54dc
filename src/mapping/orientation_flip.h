#pragma once

#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "robust/similarity.h"

namespace mono_pose_tracker {

// The sight of a point that a keyframe has by one of its features.
template <typename Keyframe>
ObservedPoint observed_point(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map) {
  const Rigid3 map_from_camera = keyframe.camera_from_map.inverse();
  ObservedPoint observation;
  observation.x = x_in_map;
  observation.center = map_from_camera.translation;
  observation.bearing = map_from_camera.rotation * keyframe.image->set.bearings[feature];
  return observation;
}

// A similarity that RANSAC has found by the angles of sights may be the wrong one of two: they leave open
// which of two ways a small patch of a wall faces. How its points lie to each other tells: it is sought from
// where these fit as well, and the cheaper of the two kept, with depths that count as well as they are known.
// depth_sigma of the sights: as far as it is known beforehand, up to a factor that is the same for all.
SimilarityReport similarity_from_points(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& by_angles);

// Beyond what two similarities of the same points differ by: a patch of a wall faces the other way. Of strips
// of a wall two lay 10 to 33 degrees apart; less is what a bundle adjustment mends.
bool is_flipped(const SimilarityReport& one, const SimilarityReport& other);

// Of two maps that see one patch of a wall each from its own side, what each does not know of depth the other
// sees across: their angles agree most where the patch is turned over. What was found, or, where that is
// turned over, what the covariances of both say; no success where these leave it open.
SimilarityReport resolve_flip_by_depths(const std::vector<SimilarityMatch>& observations,
                                        const SimilarityOptions& options, const SimilarityReport& found);

}  // namespace mono_pose_tracker
