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
struct RegistrationOptions {
  double search_radius = 0.04;       // of the longer side: round the pixels that the prediction gives
  double refine_radius_px = 3;       // at 640 px (image_scale): round the pixels that the resected pose gives
  int min_inliers = 15;              // P3P fits three; a chance pose rarely gathers ten more within 2 px
  double min_inlier_ratio = 0.25;    // of the matches
  int max_local_keyframes = 12;      // whose landmarks are looked for
  int relocalization_keyframes = 8;  // that a lost frame is compared with in one go
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
  RegistrationOptions resection;
  MappingOptions mapping;
  SegmentationOptions segmentation;
  BundleOptions bundle;
  ScaleOptions scale;
  int young_map_keyframes = 5;  // a map with no more keyframes that is lost is dropped, and a new one begun
  int young_map_patience = 10;  // frames that it may be lost before
  bool localize_only = false;   // poses only: a loaded map is never changed, and none is begun

  /// Not for a user to choose, set by cancellable. Once the flag is set, whatever takes long ends early, with
  /// what it has by then.
  CancelFlag cancelled = nullptr;

  /// Not for a user to choose, set by on_threads. How many threads share that work on a recording whose
  /// result is the same for any number.
  int threads = 1;

  /// The same, with so many threads wherever their number changes no result, and one everywhere else.
  TrackerOptions on_threads(int count) const;

  /// The same, and all that they are handed to looks at the flag.
  TrackerOptions cancellable(CancelFlag flag) const;

  /// Of RANSAC on bearings of a camera with this focal length.
  RansacOptions ransac(double focal_px) const;

  /// What the mapper needs of these, for a camera with this focal length.
  MapperOptions mapper(double focal_px) const;

  /// What these options mean for images of this size: octave, reduction and sigma are chosen where they are
  /// left open. Where they were chosen here, thresholds in px that stand for the features' noise grow with
  /// the pixels that are searched.
  TrackerOptions for_images(const cv::Size& image, SearchPace pace) const;

  /// Throws std::invalid_argument naming every key at fault, its value and range.
  void validate() const;
};

/// Kind of the descriptors that these options give features: "root_sift" or "sift". Maps of one kind can't be
/// gone on with by the other.
std::string descriptor_kind(const TrackerOptions& options);

}  // namespace mono_pose_tracker
