#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// Thresholds of find_two_motions. Lengths are in px at 640 px (image_scale): static features are found again
/// within 0.3 px, in noisy images within 0.5. Shares are in [0, 1].
struct TwoMotionsOptions {
  double min_rigid = 0.5;  // share of the moving matches, which include wrong ones, that obey one motion

  // Many static features.
  double still_px = 0.5;             // up to it a feature is static
  double nearly_still_px = 1;        // up to it a feature is not the object's
  double min_still_of_nearly = 0.7;  // share; with a moving camera, the ring between the two limits has three
                                     // times the share of the disc
  double max_mean_shift_px = 0.15;   // of the static features: accurate to hundredths, and a hand-held camera
                                     // shakes by tenths at least
  int min_still = 40;                // features; fewer are static by chance
  double min_still_share = 0.15;     // of all matches: fewer do not disturb a map of the rest

  // Few static features, as of a plain wall and a pair of shoulders, which move by a pixel. The others must
  // have moved several times that distance and left a gap: for a moving camera, all shifts up to the median
  // occur.
  double few_still_px = 1;
  double nearly_few_still_px = 2;
  int min_few_still = 12;  // features
  double min_few_still_share = 0.08;
  double min_few_of_nearly = 0.6;
  double min_few_moved_px = 6;         // median
  double max_few_mean_shift_px = 0.5;  // for the mean of a dozen shifts of up to a pixel
};

/// The motions of matches between two images: a static background in front of a fixed camera and one rigid
/// object that moves. Or a moving view and ego-vehicle features (a bonnet, a handlebar, a finger before the
/// lens).
struct TwoMotions {
  bool found = false;           // an object in front of a static background
  bool is_ego_vehicle = false;  // the static features are, as the moving ones reach around them
  int matches = 0;
  std::vector<cv::Point2f> still;                   // pixels, the same in both images
  std::vector<int> still_of_first, moved_of_first;  // features of the first image
  double moved_px = 0;                              // median of the moving features
};

/// Fits the two motions. second_of_first: match of each feature of the first image, -1: none. has_moved:
/// flags of the first image's features that moved in an image between the two (empty: unknown); they are not
/// static. A moving camera leaves nothing exactly in place: near points shift by various amounts, far points
/// by the shake of the hand. Found only when many features stay within the noise, also on average, or when a
/// few nearly do so while the others move several times as far with hardly any between; and when most of the
/// moving features obey one rigid motion. With segmentation/body: turning, the object is always wanted.
TwoMotions find_two_motions(const ImageFeatures& first, const ImageFeatures& second,
                            const std::vector<int>& second_of_first, const std::vector<char>& has_moved,
                            const CameraModel& camera, const TrackerOptions& options);

/// Features of the object: those nearer to a moving feature than to a static one. One flag for each feature.
std::vector<char> features_of_object(const ImageFeatures& image, const std::vector<cv::Point2f>& moved,
                                     const std::vector<cv::Point2f>& still, CancelFlag cancelled = nullptr);

}  // namespace mono_pose_tracker
