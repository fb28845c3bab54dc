#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

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
