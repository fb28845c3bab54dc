#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// What of the candidates an image sees: bearings in its camera, points in the map, a row each; sigmas: what
/// each bearing is located to, rad.
struct LandmarkObservations {
  std::vector<Eigen::Vector3d> bearings, points;
  std::vector<double> sigmas;
};

LandmarkObservations observations_by(const ImageFeatures& image,
                                     const std::vector<LandmarkCandidate>& candidates,
                                     const std::vector<LandmarkMatch>& matches);

/// Putative matches (paper, step 4a): by descriptors alone, in the order of the image's features.
std::vector<LandmarkMatch> match_by_descriptors(const std::vector<LandmarkCandidate>& candidates,
                                                const ImageFeatures& image, const MatchOptions& options);

struct GuidedPose {
  bool converged = false;  // in one of the two rounds at least
  bool is_steady = false;  // in both
  Rigid3 camera_from_map;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  // as refine_absolute_pose
  std::vector<LandmarkMatch> matches;  // found about the pose, inliers or not
};

/// The pose refined on what guided matching finds round it, and once more round what that gives (paper, step
/// 4c).
GuidedPose refine_by_guided_matching(const std::vector<LandmarkCandidate>& candidates,
                                     const ImageFeatures& image, const Rigid3& camera_from_map,
                                     const ProjectionMatchOptions& options);

/// Those of the matches that the pose agrees with: within this of where it shows the landmark, in px at the
/// scale of a feature of 1 px (what coarse ones are located to is more).
std::vector<LandmarkMatch> inliers_of(const ImageFeatures& image,
                                      const std::vector<LandmarkCandidate>& candidates,
                                      const std::vector<LandmarkMatch>& matches,
                                      const Rigid3& camera_from_map, double threshold_px);

}  // namespace mono_pose_tracker
