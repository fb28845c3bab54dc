#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/cancel_flag.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// A landmark that a view may see, with the descriptor of one of its observations: it points into the image
/// that the candidate was made of, which must outlive it.
struct LandmarkCandidate {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d x_in_map;
  const std::uint8_t* descriptor = nullptr;
  Eigen::Vector3d seen_from;        // unit, from the landmark to the camera that gave the descriptor
  double scale_times_distance = 0;  // px * map units: over the distance, the scale to expect
  double focal_px = 1;              // of the camera that this scale is of
};

struct LandmarkMatch {
  int candidate = -1;
  int feature = -1;
  int distance2 = 0;
};

struct ProjectionMatchOptions {
  double radius_px = 10;
  int max_distance2 = 0;
  double min_ratio = 1.0;      // second nearest in the neighbourhood over nearest
  double max_scale_ratio = 2;  // between expected and found scale: more than an octave is another structure
  double max_view_angle_deg =
      60;  // between the directions of view: SIFT holds to about 50 degrees on a plane
  CancelFlag cancelled = nullptr;  // once it is set, the other candidates are not looked for
};

/// The candidate that feature `feature` of a keyframe makes of its landmark.
LandmarkCandidate make_candidate(LandmarkId id, const Eigen::Vector3d& x_in_map, const ImageFeatures& image,
                                 int feature, const Eigen::Vector3d& center_in_map);

/// The candidates' descriptors, a row each (N x 128, CV_8U).
cv::Mat descriptors_of(const std::vector<LandmarkCandidate>& candidates);

/// Guided matching (paper, step 4c): each candidate is projected by the pose and compared with the features
/// round its pixel; a feature that several candidates claim goes to the nearest.
std::vector<LandmarkMatch> match_by_projection(const std::vector<LandmarkCandidate>& candidates,
                                               const ImageFeatures& image, const CameraModel& camera,
                                               const Rigid3& camera_from_map,
                                               const ProjectionMatchOptions& options);

/// What a pose should find of the candidates.
struct ExpectedFinds {
  int in_view = 0;      // those that it brings into view, at a scale at which they can be found
  double expected = 0;  // of these, each counts by how well SIFT knows it from so far beside
};

/// From the side from which it was seen a candidate counts 1, from 15 degrees a half, from 28 a tenth.
ExpectedFinds expected_finds(const std::vector<LandmarkCandidate>& candidates, const CameraModel& camera,
                             const Rigid3& camera_from_map, const ProjectionMatchOptions& options);

}  // namespace mono_pose_tracker
