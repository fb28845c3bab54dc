#pragma once

#include <Eigen/Core>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/mapper_input.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// The expected pixel of a landmark, and whether it was found there.
struct ExpectedLandmark {
  Eigen::Vector2d pixel;
  bool found = false;
};

struct OcclusionOptions {
  double near_px = 40;      // at 640 px (image_scale): about two descriptors wide, so that it contains a few
                            // landmarks
  double min_found = 0.25;  // share: a feature is found again in two of three images; behind a hand hardly
                            // any is
  double min_of_usual = 0.375;  // of the usual share, lower after a large step, as the limit above is
                                // relative to two thirds
};

// Features with which the map of an object may grow, one flag each. Where hardly any expected landmark is
// found, something occludes the object. With a mask found in the image: features near found landmarks, as
// others may be of anything else in the mask. With a given mask: all features except where fewer landmarks
// are found than is usual, even after a large step. scale: the image_scale.
std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  double scale, bool is_mask_given = false);

// Excludes occluders from a candidate: a mask may hold more than the object, such as a hand in front of it,
// which must not be mapped. The candidate's reference is a keyframe of the map.
void exclude_occluders(const TrackingMap& map, const CameraModel& camera, const Rigid3& camera_from_map,
                       KeyframeCandidate* candidate);

}  // namespace mono_pose_tracker
