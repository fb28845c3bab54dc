#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

// Features of one scene point: feature_of_view[v] in view v, -1 where there is no match. Views 0 and 1 always
// have one.
struct Track {
  std::vector<int> feature_of_view;
};

// One possible geometry of some views of the same scene. The first view is the map's frame.
struct ViewHypothesis {
  std::vector<Rigid3> cameras_from_map;  // one for each view
  std::vector<Eigen::Vector3d> points;   // one for each track
  std::vector<char> is_point;            // whether the track has a point on which its views agree
  double cost = 0;       // sum of squared reprojection errors, each capped at the threshold's square
  double confirmed = 0;  // share of two-view points that a further view confirms; the minimum over these
  int num_points = 0;
};

struct ViewSet {
  std::vector<ImageFeaturesPtr> images;
  std::vector<Track> tracks;
  double focal_px = 1;      // one pixel is 1 / focal_px radians
  bool has_horizon = true;  // points may be too far to triangulate; an object's are not
};

// Grows a hypothesis: triangulates points from the relative pose of two views (unit translation), registers
// each further view and runs a bundle adjustment.
ViewHypothesis grow_hypothesis(const ViewSet& views, const Rigid3& second_from_first,
                               const std::vector<char>& inliers, const TrackerOptions& options);

// Median angle in radians between the rays of views 0 and 1 to the points.
double median_parallax(const ViewSet& views, const ViewHypothesis& hypothesis);

}  // namespace mono_pose_tracker
