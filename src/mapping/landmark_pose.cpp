#include "mapping/landmark_pose.h"

#include "mono_pose_tracker/robust/absolute_pose.h"
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
    pose.matches = match_by_projection(candidates, image, pose.camera_from_map, options);
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

namespace {

AbsolutePoseReport pose_by_descriptors(const MapperOptions& options,
                                       const std::vector<LandmarkCandidate>& candidates,
                                       const ImageFeatures& image) {
  const std::vector<LandmarkMatch> matches = match_by_descriptors(candidates, image, options.matching);
  if (static_cast<int>(matches.size()) < options.min_inliers) return {};
  const LandmarkObservations visible = observations_by(image, candidates, matches);
  AbsolutePoseOptions pose_options = AbsolutePoseOptions::in_growing_map(options.ransac);
  for (const LandmarkMatch& m : matches) pose_options.quality.push_back(static_cast<float>(m.distance2));
  AbsolutePoseReport pose = estimate_absolute_pose(visible.bearings, visible.points, pose_options);
  pose.success = pose.success && pose.num_inliers >= options.min_inliers;
  return pose;
}

// Guided matching around the pose, and refinement of the pose on the matches.
bool refine(const MapperOptions& options, const std::vector<LandmarkCandidate>& candidates,
            const ImageFeatures& image, Location* location) {
  ProjectionMatchOptions guided;
  guided.radius_px = 1.5 * options.mapping.transferred_px(image.camera);
  guided.max_distance2 = stored_distance2(options.mapping.max_descriptor_distance);
  const GuidedPose pose = refine_by_guided_matching(candidates, image, location->camera_from_map, guided);
  if (!pose.is_steady) return false;
  location->camera_from_map = pose.camera_from_map;
  for (const LandmarkMatch& m : inliers_of(image, candidates, pose.matches, pose.camera_from_map,
                                           options.mapping.max_reprojection_px)) {
    location->matches.emplace_back(m.feature, candidates[m.candidate].id);
  }
  return true;
}

}  // namespace

Location locate(const MapperOptions& options, const Map& map, KeyframeId place, const ImageFeatures& image,
                const std::unordered_set<LandmarkId>& excluded) {
  Location location;
  const AbsolutePoseReport pose = pose_by_descriptors(options, candidates_of(map, {place}, excluded), image);
  if (!pose.success) return location;
  location.camera_from_map = pose.camera_from_map;
  std::vector<KeyframeId> local = {place};
  for (const auto& [id, shared] : map.covisible(place)) {
    if (static_cast<int>(local.size()) < KeyframeLocatorOptions().local_keyframes) local.push_back(id);
  }
  const std::vector<LandmarkCandidate> candidates = candidates_of(map, local, excluded);
  if (!refine(options, candidates, image, &location)) return location;
  std::vector<int> inliers;
  for (const auto& match : location.matches) inliers.push_back(match.first);
  const ExpectedFinds in_map = expected_finds(candidates, image.camera, location.camera_from_map, {});
  location.support = pose_support(image, inliers, in_map);
  location.found = is_supported(location.support, options.min_inliers);
  return location;
}

}  // namespace mono_pose_tracker
