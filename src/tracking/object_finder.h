#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>

#include "map/frame.h"
#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "segmentation/motion_mask.h"
#include "segmentation/segmenter.h"
#include "tracking/bootstrapper.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// Pixels of the features by which the frame was registered.
std::vector<cv::Point2f> pixels_of(const Frame& frame, const RegistrationReport& registration);

struct ObjectFinderOptions {
  double least_move_px = 2;       // from which a motion counts: less is pose noise
  std::size_t most_visited = 50;  // poses, after which the background is learnt
};

// Segments the object in each image (paper, step 1): by a given mask, a background or a backdrop, or by its
// motion in front of a static background once a bootstrap has separated the two. One thread.
class ObjectFinder {
 public:
  // Throws std::invalid_argument when the background image cannot be read.
  ObjectFinder(const SegmentationOptions& options, const CameraModel& camera);

  // Segments the next image. given: a mask (not 0: object), or empty. may_begin: this image may begin a map.
  // masks: the object found by its motion is the one that is tracked or searched.
  Segmentation find(const cv::Mat& image, const cv::Mat& given, bool may_begin, bool masks);
  // Segments an image out of order, without learning from it.
  Segmentation find_again(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& given, bool masks);

  // Where features are allowed, given the object's mask; empty: everywhere.
  cv::Mat clearance(const cv::Mat& mask) const { return clearance(mask, options_, camera_); }
  static cv::Mat clearance(const cv::Mat& mask, const SegmentationOptions& options,
                           const CameraModel& camera);

  // A map of an object in front of the static background has begun. The frame is the last segmented one.
  void start(const BootstrapReport& bootstrap, const Frame& frame, const RegistrationReport& registration);
  // The last frame was registered: updates where the object was and how far it has moved.
  void follow(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration);

  bool knows_motion() const { return motion_mask_.is_started(); }
  // Whether the object found by motion is given as the mask of images after this frame. While it is not,
  // nothing is learnt about it.
  void mask_by_motion(std::int64_t frame_index, bool on);

  // Later poses are of another map or have another unit.
  void forget_places() { visited_.clear(); }

  void set_options(const SegmentationOptions& options) { options_ = options; }
  void reset() {
    motion_mask_.reset();
    masks_after_.clear();
  }

 private:
  double moved_since(const Rigid3& camera_from_map, const Frame& frame, const TrackingMap& map,
                     const RegistrationReport& registration) const;
  bool looks_for_motion(const cv::Mat& given) const;
  bool masks_now() const { return masks_after_.empty() || masks_after_.rbegin()->second; }
  bool masks_at(std::int64_t frame_index) const;

  SegmentationOptions options_;
  CameraModel camera_;
  Segmenter segmenter_;
  MotionMask motion_mask_;
  // Frames after which masks by motion begin or end.
  std::map<std::int64_t, bool> masks_after_;
  std::vector<Rigid3> visited_;  // camera_from_map of new views of the object
};

}  // namespace mono_pose_tracker
