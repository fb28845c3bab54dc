#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

// Features of one scene point: feature_of_view[v] in view v, -1 where it was not matched. Views 0 and 1
// always see it.
struct Track {
  std::vector<int> feature_of_view;
};

// One geometry that some views of the same scene may have. The first view is the map's frame.
struct ViewHypothesis {
  std::vector<Rigid3> cameras_from_map;  // one a view
  std::vector<Eigen::Vector3d> points;   // one a track
  std::vector<char> is_point;            // the track has a point that its views agree on
  double cost = 0;       // sum of squared reprojection errors, each capped at the threshold's square
  double confirmed = 0;  // the least share of two-view points, over the further views, that one confirms
  int num_points = 0;
};

struct ViewSet {
  std::vector<ImageFeaturesPtr> images;
  std::vector<Track> tracks;
  double focal_px = 1;      // one pixel is 1 / focal_px radians
  bool has_horizon = true;  // points may be too far away to be placed; an object's are not
};

// Two views' relative pose (unit translation) made into points, resected in each further view and
// bundle-adjusted.
ViewHypothesis grow_hypothesis(const ViewSet& views, const Rigid3& second_from_first,
                               const std::vector<char>& inliers, const TrackerOptions& options);

// Median angle in radians between the rays of views 0 and 1 to the points.
double median_parallax(const ViewSet& views, const ViewHypothesis& hypothesis);

}  // namespace mono_pose_tracker
