#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "image_preparer.h"
#include "map/frame.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "segmentation/segmenter.h"

namespace mono_pose_tracker {

// Adds the features of a frame to the report, for drawings.
void show_features(const Frame& frame, FrameReport* report);

// Makes a Frame of an image (paper, step 2): features of the object with bearings and colours. One thread.
class FrameMaker {
 public:
  FrameMaker(const SiftOptions& sift, const ScaleOptions& scale, const SegmentationOptions& segmentation,
             const CameraModel& camera);

  // Prepares an image ahead of make(). From any thread, but not while options are set.
  PreparedImage prepare(const cv::Mat& image, const cv::Mat& mask, FeatureMemory* memory,
                        std::int64_t index) const {
    return preparer_->prepare(image, mask, memory, index);
  }

  // Returns false, with the reason in the report, when the image does not have the camera's size.
  bool has_camera_size(const cv::Mat& image, FrameReport* report) const;

  // clearance: where features are allowed (empty: everywhere). Nothing, with the reason in the report, when
  // the object is not known yet.
  std::optional<Frame> make(std::int64_t index, std::int64_t stamp_ns, const PreparedImage& prepared,
                            const Segmentation& segmentation, const cv::Mat& clearance, bool looks_for_marker,
                            FrameReport* report);

  void set_options(const SiftOptions& sift, const SegmentationOptions& segmentation);

 private:
  ImageFeaturesPtr features_of(const PreparedImage& prepared, const cv::Mat& gray, const cv::Mat& clearance,
                               StageTimes* stages);

  ScaleOptions scale_;
  CameraModel camera_;
  std::unique_ptr<FeatureExtractor> extractor_;
  std::shared_ptr<const ImagePreparer> preparer_;
};

}  // namespace mono_pose_tracker
