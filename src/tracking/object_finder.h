#pragma once

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

// Where the frame sees what it was posed by.
std::vector<cv::Point2f> pixels_of(const Frame& frame, const RegistrationReport& registration);

// Which pixels of each image are the object (paper, step 1): by a given mask, a background or a backdrop, or
// by its motion before a still background once a bootstrap has told the two apart. One thread.
class ObjectFinder {
 public:
  // Throws std::invalid_argument when the background image can't be read.
  ObjectFinder(const SegmentationOptions& options, const CameraModel& camera);

  // The next image. given: empty, or not 0 = object. may_begin: a map may be begun by it. masks: the object
  // that was found by its motion is the one that is tracked or looked for.
  Segmentation find(const cv::Mat& image, const cv::Mat& given, bool may_begin, bool masks);
  // An image out of its order: nothing is learnt.
  Segmentation find_again(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& given, bool masks);

  // Where features may be, given the object's mask; empty: anywhere.
  cv::Mat clearance(const cv::Mat& mask) const { return clearance(mask, options_, camera_); }
  static cv::Mat clearance(const cv::Mat& mask, const SegmentationOptions& options,
                           const CameraModel& camera);

  // A map has begun: of an object before the still background that the bootstrap found. The frame is the one
  // that was found last.
  void start(const BootstrapReport& bootstrap, const Frame& frame, const RegistrationReport& registration);
  // The last frame was posed: where the object was found, and how far it has gone.
  void follow(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration);

  bool knows_motion() const { return motion_mask_.is_started(); }
  // Whether what moves, once it has been told from what stands still, is given as the mask of what comes
  // after the frame. While it is not, nothing is learnt of it.
  void mask_by_motion(std::int64_t frame_index, bool on);

  // Poses from here on are of another map, or in other lengths.
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
  // Frames after which masks by motion are given, or no longer are.
  std::map<std::int64_t, bool> masks_after_;
  std::vector<Rigid3> visited_;  // camera_from_map, where the object was seen anew
};

}  // namespace mono_pose_tracker
