#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "map/frame.h"
#include "map/turning_object.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

// Follows a body that was told from what else moves, from image to image. Live, where no second look at the
// recording can tell.
class ObjectFollower {
 public:
  explicit ObjectFollower(TurningObject start) : last_(std::move(start)) {}

  // Leaves the frame the body's features: those nearer to where it is found by descriptors than to what moves
  // otherwise. False, and all features, where too few of it are found.
  bool follow(const CameraModel& camera, const TrackerOptions& options, Frame* frame);

  // The frame that was followed last was posed by features at these pixels: the body is where they are.
  void settle(const std::vector<cv::Point2f>& inliers);
  // The same of a frame that was posed by all of its features; those of the body are left to it.
  Frame settle(const CameraModel& camera, const Frame& frame, const std::vector<cv::Point2f>& inliers);

 private:
  // As few say nothing of where a body is.
  static constexpr std::size_t kFewest = 8;

  std::vector<cv::Point2f> known_pixels(const ImageFeatures& image, FeatureMotion side) const;
  // Every feature of the image is one or the other's: what it was in the image before, or whichever is
  // nearer.
  void divide(ImageFeaturesPtr image, const std::vector<cv::Point2f>& turning);

  TurningObject last_;
  std::vector<FeatureMotion>
      known_;  // of the features of the image that was asked for last: by the one before
};

}  // namespace mono_pose_tracker
