#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/segmentation/segmentation_options.h"
#include "segmentation/background_model.h"

namespace mono_pose_tracker {

/// Thresholds of MotionMask. Lengths are in px of the reduced image (320 px width), shares in [0, 1].
struct MotionMaskOptions {
  MaskRadii radii;
  float still_path = 3;  // of the object: after this displacement most pixels of a fine texture have changed

  // Texture: range of the grey levels in a window.
  int texture_window = 5;      // px
  double min_texture = 24;     // grey levels: three times what counts as a change
  int agreement_window = 9;    // px. An edge along its own direction of motion looks static: most of the
                               // texture around a static pixel must be static too
  float min_agreement = 0.7F;  // share of this texture

  float object_reach = 24;       // around a feature of the object; pixels beyond are background
  float object_clear = 10;       // minimal distance from the object's features at which background is learnt,
                                 // textured or not
  double component_share = 0.1;  // smallest share of the object's features in a component of the foreground
                                 // that belongs to the object

  // The camera has moved when a large share of the known background vanishes within a few images; an
  // approaching object takes longer to hide as much.
  double lost_share = 0.7;
  double min_known_share = 0.2;  // of the image: with less known background no movement is reported
  int lost_images = 5;           // in a row

  double sigma = 1.6;  // grey levels: noise of a webcam at half its size
};

/// The outline of an object that moves in front of a static background, without a mask. Texture that did not
/// change while the object moved is learnt as background; everything that differs from it is then the object.
/// Unknown pixels take the label of the nearest evidence: features of the object, or static texture. When
/// most of the known background vanishes at once, the camera itself has moved: the background is forgotten,
/// the object stays. Points and distances are in px of the images. One thread.
class MotionMask {
 public:
  explicit MotionMask(const SegmentationOptions& options, const MotionMaskOptions& thresholds = {});

  /// Each image in order, all CV_8UC1 or all BGR. Before the start, only records how long each pixel has been
  /// constant.
  void watch(const cv::Mat& image);

  /// Starts with an object: features of the object and of the background in the last image, the number of
  /// images since it was elsewhere, and the distance from there.
  void start(const std::vector<cv::Point2f>& object, const std::vector<cv::Point2f>& background,
             int images_ago, double moved_px);
  bool is_started() const { return started_; }

  /// The object in the last image: CV_8UC1 of its size, 255 = object.
  cv::Mat mask() const { return mask_; }

  /// Features of the object in the last image, and the distance it has moved since the last call.
  void observe(const std::vector<cv::Point2f>& object, double moved_px);

  /// The object in an image out of order, from the known background.
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
  MotionMaskOptions thresholds_;
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
