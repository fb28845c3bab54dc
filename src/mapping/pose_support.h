#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// When a pose has enough support. Shares are in [0, 1].
struct PoseSupportOptions {
  double min_found = 0.2;  // share of the expected landmarks
  // From the first share of the landmarks in view on, any viewpoint is possible. Below it, no more than the
  // second number times the expectation may be found.
  double min_found_from_near = 0.15, max_oblique_excess = 2;
  int few_features = 150;    // of the image: with fewer, missing landmarks are no evidence
  double min_spread = 0.25;  // share of the cells with features
  double corner = 0.125;     // the same, below which the inliers may be of a small object
};

/// Evidence for a pose that was not predicted: expected landmarks that were found, and their distribution
/// over the image.
struct PoseSupport {
  int found = 0;  // inliers
  ExpectedFinds in_map;
  double spread = 0;  // share of the cells with features that hold inliers
  int features = 0;   // of the image
};

/// inliers: features of the image that agree with the pose. The image is divided into 8 x 6 cells.
PoseSupport pose_support(const ImageFeatures& image, int width, int height, const std::vector<int>& inliers,
                         const ExpectedFinds& in_map);

/// Whether the pose has enough support to be accepted once a second view agrees. SIFT finds two of three
/// expected landmarks, one of four in a blurred image. At an aliased place (one window of many, one door of a
/// row) the surroundings are not found: one of seven is usual, one of five rare, and the finds lie in one
/// corner. The expectation is limited to the number of features in the image, but is at least thirty. A pose
/// is aliased where fewer landmarks are expected than a pose needs, as from behind. It is also aliased where
/// the expectation is below 15 % of the landmarks in view, as at oblique views, and more than twice as many
/// are found.
bool is_supported(const PoseSupport& support, int min_inliers);

/// Whether the inliers lie in less than an eighth of the cells with features. The pose may then depend on a
/// small independently moving object.
bool is_confined_to_corner(const PoseSupport& support);

}  // namespace mono_pose_tracker
