#pragma once

#include <Eigen/Core>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Observations of landmarks in an image, one entry for each match: bearing in the camera, point in the map,
/// standard deviation of the bearing (rad).
struct LandmarkObservations {
  std::vector<Eigen::Vector3d> bearings, points;
  std::vector<double> sigmas;
};

LandmarkObservations observations_by(const ImageFeatures& image,
                                     const std::vector<LandmarkCandidate>& candidates,
                                     const std::vector<LandmarkMatch>& matches);

/// Putative matches (paper, step 4a) by descriptors alone, in the order of the image's features.
std::vector<LandmarkMatch> match_by_descriptors(const std::vector<LandmarkCandidate>& candidates,
                                                const ImageFeatures& image, const MatchOptions& options);

struct GuidedPose {
  bool converged = false;  // in at least one of the two rounds
  bool is_steady = false;  // in both
  Rigid3 camera_from_map;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  // as refine_absolute_pose
  std::vector<LandmarkMatch> matches;  // guided matches, inliers or not
};

/// Refines the pose on guided matches around it, then once more on guided matches around the refined pose
/// (paper, step 4c).
GuidedPose refine_by_guided_matching(const std::vector<LandmarkCandidate>& candidates,
                                     const ImageFeatures& image, const Rigid3& camera_from_map,
                                     const ProjectionMatchOptions& options);

/// Inlier matches of the pose: those with a reprojection error below threshold_px, in px for a feature of
/// scale 1 px (coarser features have a larger limit).
std::vector<LandmarkMatch> inliers_of(const ImageFeatures& image,
                                      const std::vector<LandmarkCandidate>& candidates,
                                      const std::vector<LandmarkMatch>& matches,
                                      const Rigid3& camera_from_map, double threshold_px);

struct KeyframeLocatorOptions {
  int local_keyframes = 12;  // whose landmarks verify the pose: the place and those that share most with it
};

/// The pose of an image in a map in which it was not registered.
struct Location {
  bool found = false;
  Rigid3 camera_from_map;
  std::vector<std::pair<int, LandmarkId>> matches;  // feature, landmark: the inliers
  PoseSupport support;
};

/// Registers an image at one place of a map (a keyframe and its covisible keyframes): descriptor matching,
/// P3P RANSAC, guided matching, refinement. `found` means that the pose is supported (is_supported);
/// callers should require a second consistent view. excluded: landmarks that are not used.
Location locate(const MapperOptions& options, const Map& map, KeyframeId place, const ImageFeatures& image,
                const std::unordered_set<LandmarkId>& excluded = {});

}  // namespace mono_pose_tracker
