#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "segmentation/background_model.h"

namespace mono_pose_tracker {

/// The outline of an object that moves before a background that stands still, with no mask known beforehand.
/// Texture that did not change while the object moved on is background: it is learnt, and then whatever
/// differs from it is the object. Pixels nothing is known of go with the nearest evidence: features of the
/// object, or still texture. When most of the known background is gone at once, the camera itself has moved:
/// what was known of it is forgotten; the object stays. Points are in px of the images; distances of the
/// object's movement, too. One thread.
class MotionMask {
 public:
  explicit MotionMask(const SegmentationOptions& options);

  /// Each image in order, all CV_8UC1 or all BGR. Until started, only remembers how long each pixel is the
  /// same.
  void watch(const cv::Mat& image);

  /// From now on there is an object: its features and the background's in the last image, how many images ago
  /// it was elsewhere, and how far from here.
  void start(const std::vector<cv::Point2f>& object, const std::vector<cv::Point2f>& background,
             int images_ago, double moved_px);
  bool is_started() const { return started_; }

  /// The object in the last image: CV_8UC1 of its size, 255 = object.
  cv::Mat mask() const { return mask_; }

  /// Features found to be the object's in the last image, and how far it has moved since the last call.
  void observe(const std::vector<cv::Point2f>& object, double moved_px);

  /// The object in an image out of order, by what is known of the background.
  cv::Mat mask_of(const cv::Mat& image) const;

  void reset();

 private:
  void begin(const cv::Mat& small);
  void note_changes();
  void find_object();
  cv::Mat still_texture() const;
  cv::Mat known_outside() const;
  cv::Mat nearer_to_object(const cv::Mat& still, const cv::Mat& to_object) const;
  cv::Mat with_object_points(const cv::Mat& cleaned) const;
  void learn(const cv::Mat& still, const cv::Mat& near_object, const cv::Mat& to_object,
             const cv::Mat& found);
  cv::Point reduced_point(const cv::Point2f& point) const;
  float reduced_length(double px) const;

  SegmentationOptions options_;
  bool started_ = false;
  int images_lost_ = 0;  // in a row that showed little of the known background
  cv::Size full_size_;
  cv::Mat image_;      // the last one, reduced
  cv::Mat unchanged_;  // [pixel] as it has been since
  cv::Mat since_;      // CV_32F [pixel]: what path_ was then
  float path_ = 0;     // of the object, px of the reduced image; until started, images
  BackgroundModel background_;
  cv::Mat known_;  // 255 where the background model holds
  cv::Mat mask_;   // full size
  cv::Mat outside_;
  std::vector<cv::Point> object_points_, background_points_;  // px of the reduced image
};

}  // namespace mono_pose_tracker
