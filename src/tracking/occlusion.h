#pragma once

#include <Eigen/Core>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/keyframe_candidate.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Where a landmark should be seen, and whether it was.
struct ExpectedLandmark {
  Eigen::Vector2d pixel;
  bool found = false;
};

// Which features a map of the object may grow by, one flag each. Where landmarks should be seen and hardly
// any is, something else is before the object. By a mask that was found in the image: those near landmarks
// that were found, as what is far from all of them may be anything that the mask took in with it. By one that
// was given: all but where fewer landmarks are found than is usual, even after a large step. scale: the
// image_scale.
std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  double scale, bool is_mask_given = false);

// A mask may hold more than the object: a hand before it, say, of which nothing must come into the map. The
// candidate keeps the features that may; its reference is a keyframe of the map.
void exclude_occluders(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map,
                       KeyframeCandidate* candidate);

}  // namespace mono_pose_tracker
