#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

/// What speaks for a pose that nothing predicted: landmarks that should be in view and were found, spread
/// over where the image has features at all.
struct PoseSupport {
  int found = 0;  // inliers
  ExpectedFinds in_map;
  double spread = 0;  // share of the cells of the image with features in which there are inliers
  int features = 0;   // of the image
};

/// inliers: features of the image that agree with the pose. The image is cut into 8 x 6 cells.
PoseSupport pose_support(const ImageFeatures& image, int width, int height, const std::vector<int>& inliers,
                         const ExpectedFinds& in_map);

/// Whether the pose may be believed once a second view agrees. Of what is to be expected SIFT finds two in
/// three, one in four of a blurred image; look-alikes (one window of many, one door of a row) leave what
/// surrounds them unfound: one in seven is usual, one in five rare. They also sit in one corner of it. Where
/// a map shows more than the image has features, no more than these can be found; of an image with few, a
/// wall seen through one window, thirty are asked for all the same. Where less is to be expected than a pose
/// needs, as from behind, what is found is a look-alike; so it is where it is less than 15 % of what is in
/// view, as from far beside, and yet more than twice what is to be expected from there: one side of a temple
/// for another.
bool is_supported(const PoseSupport& support, int min_inliers);

/// Whether the inliers lie in less than an eighth of the cells with anything to see: what holds the pose may
/// then be something in this corner that moves by itself.
bool is_confined_to_corner(const PoseSupport& support);

}  // namespace mono_pose_tracker
