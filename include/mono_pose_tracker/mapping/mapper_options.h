#pragma once

#include <algorithm>
#include <string>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// Conditions for a keyframe, and the mapper's processing of it (paper, steps 4c and 4d).
struct MappingOptions {
  double keyframe_overlap =
      0.8;  // a keyframe is due when a smaller share of the reference's landmarks is in view
  double keyframe_parallax_deg = 2;  // or at this median parallax to the reference
  double keyframe_found = 0.85;      // or below this share of the most inliers since the last keyframe
  int matching_keyframes = 8;        // covisible keyframes matched with a new one
  int window_keyframes = 10;         // keyframes moved by the windowed bundle adjustment
  int window_landmarks = 200;        // of each of these, that hold the poses; the others follow; live only
  double min_parallax_deg = 0.6;     // of a new landmark's two rays
  double max_reprojection_px = 2.5;  // of an observation
  double feature_pixel_size = 1;  // px of the image in one that is searched; the line above has grown by it
  double max_descriptor_distance = 0.6;  // of an observation to its landmark, unit descriptors
  double redundant_overlap = 0.95;       // a keyframe is removed when three others observe this share of it
  int max_keyframes = 0;                 // 0: no limit; else the most redundant are removed
  double bundle_seconds = 0.25;  // budget of a windowed bundle adjustment, live only: offline results repeat

  /// Reprojection error of an observation to a pose estimated from other observations, px. It grows with the
  /// image, or with the size of the searched pixels where that is larger.
  double transferred_px(const CameraModel& camera) const {
    return max_reprojection_px * std::max(1.0, image_scale(camera) / feature_pixel_size);
  }
};

/// Sources of a unit in metres, at most one of them (0: not known). Without any, the median distance of the
/// first view's points is 1.
struct ScaleOptions {
  double known_baseline = 0;                 // m between the first and the last view of the first map
  double initial_median_depth = 0;           // m, distance of the first view's points
  double marker_size = 0;                    // m: side of a square marker that two keyframes observe
  std::string marker_dictionary = "4x4_50";  // dictionary of the marker
  int marker_id = 0;
  bool odometry = false;  // live: from the path of ~odom_frame
};

/// Options of the mapper.
struct MapperOptions {
  MappingOptions mapping;
  ScaleOptions scale;
  MatchOptions matching;
  BundleOptions bundle;
  RansacOptions ransac;            // threshold in radians
  int min_inliers = 15;            // of a pose that connects two keyframes
  bool is_live = true;             // the motions in view are watched, and the whole map is adjusted now and
                                   // then, in the background; a recording is checked and adjusted at its end
  bool separates_motions = false;  // excludes independently moving features
  bool tells_background = true;    // live; separates a static background where no mask does
  int threads = 1;                 // the result is the same for any number

  /// Options of a windowed bundle adjustment, which has a time budget.
  BundleOptions window_bundle() const {
    BundleOptions options = bundle;
    options.max_seconds = mapping.bundle_seconds;
    return options;
  }
};

}  // namespace mono_pose_tracker
