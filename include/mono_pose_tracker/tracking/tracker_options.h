#pragma once

#include <cstdint>
#include <string>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"
#include "mono_pose_tracker/robust/ransac_options.h"
#include "mono_pose_tracker/segmentation/segmentation_options.h"

namespace mono_pose_tracker {

/// Options of the first map (paper, step 3).
struct BootstrapOptions {
  int min_features = 40;          // an image with fewer cannot begin a map
  int min_matches = 30;           // with fewer, a later frame replaces the reference frame
  int min_landmarks = 25;         // points of the first map
  double min_parallax_deg = 0.3;  // median angle between the two rays of a match
  double min_parallax_px = 3.0;   // the same in px; below it, depths are noise
  double max_rotation_only =
      0.9;  // share of the matches that a rotation explains; above it, there is no translation
  double min_confirmed = 0.6;  // share of the two-view points that the third view must confirm
  double min_evidence = 0.05;  // margin of the runner-up's cost; with less, another view is awaited
  int max_frames = 24;         // stored between the reference and the newest frame
};

/// Registration of a frame (paper, steps 4a and 4b).
struct RegistrationOptions {
  double search_radius = 0.04;       // of the longer side: around the predicted pixels
  double refine_radius_px = 3;       // at 640 px (image_scale): around the pixels under the registered pose
  int min_inliers = 15;              // P3P fits three; an accidental pose rarely has ten more within 2 px
  double min_inlier_ratio = 0.25;    // of the matches
  int max_local_keyframes = 12;      // keyframes whose landmarks are matched
  int relocalization_keyframes = 8;  // keyframes compared with a lost frame at a time
};

/// All options of a user. Two runs with the same options and images give the same bytes.
struct TrackerOptions {
  std::uint64_t seed = 0;
  double inlier_threshold_px =
      2.0;                     // reprojection error of an inlier: 3 sigma of SIFT's 0.6 px in blurred video
  double confidence = 0.9999;  // of RANSAC
  int max_iterations = 2000;   // of RANSAC
  SiftOptions sift;
  MatchOptions matching;
  BootstrapOptions bootstrap;
  RegistrationOptions resection;
  MappingOptions mapping;
  SegmentationOptions segmentation;
  BundleOptions bundle;
  ScaleOptions scale;
  int young_map_keyframes = 5;  // a lost map with at most this number is replaced by a new one
  int young_map_patience = 10;  // lost frames before that
  bool localize_only = false;   // poses only: a loaded map is never changed, and none is begun

  /// Set by cancellable, not by a user. Once the flag is set, long work ends early with the result so far.
  CancelFlag cancelled = nullptr;

  /// Set by on_threads, not by a user. Number of threads for work on a recording whose result is the same for
  /// any number.
  int threads = 1;

  /// The same options with this number of threads wherever it does not change results, and one everywhere
  /// else.
  TrackerOptions on_threads(int count) const;

  /// The same options with this cancel flag everywhere.
  TrackerOptions cancellable(CancelFlag flag) const;

  /// Options of RANSAC on bearings of a camera with this focal length.
  RansacOptions ransac(double focal_px) const;

  /// Options of the mapper for a camera with this focal length.
  MapperOptions mapper(double focal_px) const;

  /// The options for images of this size: octave, reduction and sigma are chosen where they are open. Where
  /// they are chosen here, px thresholds for the features' noise grow with the searched pixels. load_level:
  /// that of Tracker::set_load_level.
  TrackerOptions for_images(const cv::Size& image, SearchPace pace, int load_level = 0) const;

  /// Throws std::invalid_argument naming every key at fault, its value and range.
  void validate() const;
};

/// Kind of the descriptors with these options: "root_sift" or "sift". Maps of one kind cannot be continued
/// with the other.
std::string descriptor_kind(const TrackerOptions& options);

}  // namespace mono_pose_tracker
