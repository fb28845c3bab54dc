#include "mapping/keyframe_locator.h"

#include <utility>
#include <vector>

#include "landmark_candidates.h"
#include "mapping/landmark_pose.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

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
                const std::unordered_set<LandmarkId>& excluded, const KeyframeLocatorOptions& locator) {
  const CameraModel& camera = image.camera;
  Location location;
  const AbsolutePoseReport pose = pose_by_descriptors(options, candidates_of(map, {place}, excluded), image);
  if (!pose.success) return location;
  location.camera_from_map = pose.camera_from_map;
  std::vector<KeyframeId> local = {place};
  for (const auto& [id, shared] : map.covisible(place)) {
    if (static_cast<int>(local.size()) < locator.local_keyframes) local.push_back(id);
  }
  const std::vector<LandmarkCandidate> candidates = candidates_of(map, local, excluded);
  if (!refine(options, candidates, image, &location)) return location;
  std::vector<int> inliers;
  for (const auto& match : location.matches) inliers.push_back(match.first);
  const ExpectedFinds in_map = expected_finds(candidates, camera, location.camera_from_map, {});
  location.support = pose_support(image, camera.width(), camera.height(), inliers, in_map);
  location.found = is_supported(location.support, options.min_inliers, locator.support);
  return location;
}

}  // namespace mono_pose_tracker
