#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// How the matches of two images have moved: those of a background that stands still before a fixed camera,
/// and those of one rigid object that moves before it. Or those of the view, and of what is fixed to the
/// camera that moves through it (a bonnet, a handlebar, a finger before the lens).
struct TwoMotions {
  bool found = false;           // an object before a still background
  bool is_ego_vehicle = false;  // what stands still is, since what moves reaches round it
  int matches = 0;
  std::vector<cv::Point2f> still;                   // pixels, the same in both images
  std::vector<int> still_of_first, moved_of_first;  // features of the first image
  double moved_px = 0;                              // median, of the moved ones
};

/// Fits the two motions. second_of_first: matched feature of each of the first's, -1 where none. has_moved:
/// flags of the first's features that some image between shows elsewhere (empty: none is known); they are not
/// still, wherever they are now. A camera that moves itself leaves nothing exactly in its place: what is near
/// shifts by all amounts, what is far by as much as the hand shakes. Hence found only when many features
/// stand as still as noise lets them, in the mean as well, or a few nearly so while the others are several
/// times as far away and hardly any between; and most of those that moved obey one rigid motion. With
/// segmentation/body: turning it is always the object that is wanted.
TwoMotions find_two_motions(const ImageFeatures& first, const ImageFeatures& second,
                            const std::vector<int>& second_of_first, const std::vector<char>& has_moved,
                            const CameraModel& camera, const TrackerOptions& options);

/// Which features are the object's: those nearer to a moved place than to a still one. One flag a feature.
std::vector<char> features_of_object(const ImageFeatures& image, const std::vector<cv::Point2f>& moved,
                                     const std::vector<cv::Point2f>& still, CancelFlag cancelled = nullptr);

}  // namespace mono_pose_tracker
