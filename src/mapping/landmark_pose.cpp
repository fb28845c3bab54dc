#include "mapping/landmark_pose.h"

#include "robust/motion_refinement.h"

namespace mono_pose_tracker {

LandmarkObservations observations_by(const ImageFeatures& image,
                                     const std::vector<LandmarkCandidate>& candidates,
                                     const std::vector<LandmarkMatch>& matches) {
  LandmarkObservations visible;
  for (const LandmarkMatch& m : matches) {
    visible.bearings.push_back(image.set.bearings[m.feature]);
    visible.points.push_back(candidates[m.candidate].x_in_map);
    visible.sigmas.push_back(image.sigma_px[m.feature] / image.camera.focal());
  }
  return visible;
}

std::vector<LandmarkMatch> match_by_descriptors(const std::vector<LandmarkCandidate>& candidates,
                                                const ImageFeatures& image, const MatchOptions& options) {
  std::vector<LandmarkMatch> matches;
  for (const Match& m : match_descriptors(image.set.descriptors, descriptors_of(candidates), options)) {
    matches.push_back({m.second, m.first, m.distance2});
  }
  return matches;
}

GuidedPose refine_by_guided_matching(const std::vector<LandmarkCandidate>& candidates,
                                     const ImageFeatures& image, const Rigid3& camera_from_map,
                                     const ProjectionMatchOptions& options) {
  GuidedPose pose;
  pose.camera_from_map = camera_from_map;
  pose.is_steady = true;
  for (int round = 0; round < 2; ++round) {
    pose.matches = match_by_projection(candidates, image, image.camera, pose.camera_from_map, options);
    const LandmarkObservations visible = observations_by(image, candidates, pose.matches);
    const MotionRefinementReport refined =
        refine_absolute_pose(visible.bearings, visible.points, visible.sigmas, pose.camera_from_map, {});
    pose.is_steady = pose.is_steady && refined.converged;
    if (!refined.converged) continue;
    pose.converged = true;
    pose.camera_from_map = refined.camera_from_map;
    pose.covariance = refined.covariance;
  }
  return pose;
}

std::vector<LandmarkMatch> inliers_of(const ImageFeatures& image,
                                      const std::vector<LandmarkCandidate>& candidates,
                                      const std::vector<LandmarkMatch>& matches,
                                      const Rigid3& camera_from_map, double threshold_px) {
  std::vector<LandmarkMatch> inliers;
  for (const LandmarkMatch& m : matches) {
    const Eigen::Vector3d x_in_camera = camera_from_map * candidates[m.candidate].x_in_map;
    if (weighted_error(image, m.feature, x_in_camera) < threshold_px) inliers.push_back(m);
  }
  return inliers;
}

}  // namespace mono_pose_tracker
