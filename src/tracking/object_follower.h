#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "map/frame.h"
#include "map/tracking_map.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

struct ObjectFollowerOptions {
  std::size_t min_features = 8;  // fewer do not locate an object
};

// Follows an object that was separated from other motions from image to image. Used live, where the recording
// cannot be evaluated a second time.
class ObjectFollower {
 public:
  explicit ObjectFollower(TurningObject start) : last_(std::move(start)) {}

  // Reduces the frame to the object's features: those nearer to matched features of the object than to ones
  // that move independently. Returns false and keeps all features where too few of the object's are found.
  bool follow(const TrackerOptions& options, Frame* frame);

  // The last followed frame was registered by features at these pixels: they belong to the object.
  void settle(const std::vector<cv::Point2f>& inliers);
  // The same for a frame that was registered by all of its features. Returns the frame reduced to the
  // object's features.
  Frame settle(const Frame& frame, const std::vector<cv::Point2f>& inliers);

 private:
  std::vector<cv::Point2f> known_pixels(const ImageFeatures& image, FeatureMotion side) const;
  // Assigns every feature of the image to the object or to other motions: as in the previous image, else by
  // the nearest feature.
  void divide(ImageFeaturesPtr image, const std::vector<cv::Point2f>& turning);

  TurningObject last_;
  std::vector<FeatureMotion> known_;  // of the features of the last image, by the one before
};

}  // namespace mono_pose_tracker
