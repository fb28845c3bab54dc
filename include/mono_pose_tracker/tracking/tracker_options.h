#pragma once

#include <cstdint>
#include <string>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"
#include "mono_pose_tracker/segmentation/segmentation_options.h"

namespace mono_pose_tracker {

/// How the first map is made (paper, step 3).
struct BootstrapOptions {
  int min_features = 40;   // fewer in an image: it can't start a map
  int min_matches = 30;    // fewer to the reference frame: it is lost from view, a later frame replaces it
  int min_landmarks = 25;  // points of the first map
  double min_parallax_deg = 0.3;  // median angle between the two rays of a match
  double min_parallax_px = 3.0;   // the same in px: below, depth is lost in the noise of the features
  double max_rotation_only =
      0.9;  // share of the matches that a rotation alone explains: above, no translation is seen
  double min_confirmed = 0.6;  // share of the two-view points that the third view must confirm
  double min_evidence =
      0.05;             // the runner-up's cost must be higher by this share, or another view is awaited
  int max_frames = 24;  // kept between the reference and the newest frame
};

/// How a frame is posed (paper, steps 4a and 4b).
struct ResectionOptions {
  double search_radius = 0.04;       // of the image's width: round the pixels that the prediction gives
  double refine_radius_px = 3;       // round the pixels that the resected pose gives, at 640 px width or less
  int min_inliers = 15;              // P3P fits three; a chance pose rarely gathers ten more within 2 px
  double min_inlier_ratio = 0.25;    // of the matches
  int max_local_keyframes = 12;      // whose landmarks are looked for
  int relocalization_keyframes = 8;  // that a lost frame is compared with in one go
};

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
  double max_descriptor_distance = 0.6;  // of an observation to its landmark, unit descriptors
  double redundant_overlap = 0.95;       // a keyframe goes when three others see this share of its landmarks
  double bundle_seconds = 0.25;  // budget of a windowed bundle adjustment, live only: offline results repeat
};

/// What sets the map's unit to metres, one of them at most (0: not known). Without any, the median depth of
/// the first view's points is 1.
struct ScaleOptions {
  double known_baseline = 0;        // m between the first and the last of the views that begin the map
  double initial_median_depth = 0;  // m, of the first view's points
  double marker_size = 0;           // m: side of a square marker that two of the views that begin the map see
  std::string marker_dictionary = "4x4_50";  // that it is of
  int marker_id = 0;
};

/// All that a user can choose. Two runs with the same options and images give the same bytes.
struct TrackerOptions {
  std::uint64_t seed = 0;
  double inlier_threshold_px =
      2.0;                     // reprojection error of an inlier: 3 sigma of SIFT's 0.6 px in blurred video
  double confidence = 0.9999;  // of RANSAC
  int max_iterations = 2000;   // of RANSAC
  SiftOptions sift;
  MatchOptions matching;
  BootstrapOptions bootstrap;
  ResectionOptions resection;
  MappingOptions mapping;
  SegmentationOptions segmentation;
  BundleOptions bundle;
  ScaleOptions scale;
  int young_map_keyframes = 5;  // a map with no more keyframes that is lost is dropped, and a new one begun
  int young_map_patience = 10;  // frames that it may be lost before

  /// Of RANSAC on bearings of a camera with this focal length.
  RansacOptions ransac(double focal_px) const;

  /// Throws std::invalid_argument naming every key at fault, its value and range.
  void validate() const;
};

}  // namespace mono_pose_tracker
