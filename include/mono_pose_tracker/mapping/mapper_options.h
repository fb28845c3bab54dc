#pragma once

#include <algorithm>
#include <string>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// When a frame becomes a keyframe and what the mapper does with it (paper, steps 4c and 4d).
struct MappingOptions {
  double keyframe_overlap =
      0.8;  // a keyframe is due when fewer of the reference keyframe's landmarks are seen
  double keyframe_parallax_deg = 2;  // or when the median landmark has turned by this much since
  double keyframe_found =
      0.85;  // or when fewer inliers are left than this share of the most since the last keyframe
  int matching_keyframes = 8;        // covisible keyframes that a new one is matched with
  int window_keyframes = 10;         // that the windowed bundle adjustment moves
  int window_landmarks = 200;        // of each of these, that hold the poses; the others follow; live only
  double min_parallax_deg = 0.6;     // of a new landmark's two rays
  double max_reprojection_px = 2.5;  // of an observation
  double feature_pixel_size = 1;  // px of the image in one that is searched; the line above has grown by it
  double max_descriptor_distance = 0.6;  // of an observation to its landmark, unit descriptors
  double redundant_overlap = 0.95;       // a keyframe goes when three others see this share of its landmarks
  int max_keyframes = 0;                 // 0: no limit; else the least useful go
  double bundle_seconds = 0.25;  // budget of a windowed bundle adjustment, live only: offline results repeat

  /// px: the error of an observation to a pose that others gave, which grows with the image, or with the
  /// pixels that are searched where these are larger.
  double transferred_px(const CameraModel& camera) const {
    return max_reprojection_px * std::max(1.0, image_scale(camera) / feature_pixel_size);
  }
};

/// What sets the map's unit to metres, one of them at most (0: not known). Without any, the median depth of
/// the first view's points is 1.
struct ScaleOptions {
  double known_baseline = 0;        // m between the first and the last of the views that begin the map
  double initial_median_depth = 0;  // m, of the first view's points
  double marker_size = 0;           // m: side of a square marker that two of the map's keyframes see
  std::string marker_dictionary = "4x4_50";  // that it is of
  int marker_id = 0;
  bool odometry = false;  // live: from the way that ~odom_frame says the camera went
};

/// What the mapper needs to know.
struct MapperOptions {
  MappingOptions mapping;
  ScaleOptions scale;
  MatchOptions matching;
  BundleOptions bundle;
  RansacOptions ransac;            // threshold in radians
  int min_inliers = 15;            // of a pose that ties two keyframes
  bool watches_rigidity = true;    // live; a recording is checked as a whole when it ends
  bool separates_motions = false;  // leaves out what moves otherwise than the body, all together
  bool tells_background = true;    // live; from what moves before it, where no mask does
  bool adjusts_all = true;         // live, now and then, aside; a recording is when it ends
  int threads = 1;                 // the result is the same for any number

  /// Of a windowed bundle adjustment, which has a budget of time.
  BundleOptions window_bundle() const {
    BundleOptions options = bundle;
    options.max_seconds = mapping.bundle_seconds;
    return options;
  }
};

}  // namespace mono_pose_tracker
