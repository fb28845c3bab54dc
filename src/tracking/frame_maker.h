#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/map/frame.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/segmentation/segmenter.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

// Makes an image into what tracking works with (paper, step 2): features of the object, their bearings and
// colours. One thread.
class FrameMaker {
 public:
  FrameMaker(const SiftOptions& sift, const ScaleOptions& scale, const CameraModel& camera);

  // False, the reason in the report, when the image is not of the camera's size.
  bool has_camera_size(const cv::Mat& image, FrameReport* report) const;

  // clearance: where features may be (empty: anywhere). Nothing, the reason in the report, when the object is
  // not known yet.
  std::optional<Frame> make(std::int64_t index, std::int64_t stamp_ns, const cv::Mat& image,
                            const Segmentation& segmentation, const cv::Mat& clearance, bool looks_for_marker,
                            FrameReport* report);

  void set_options(const SiftOptions& sift);

 private:
  ScaleOptions scale_;
  CameraModel camera_;
  std::unique_ptr<FeatureExtractor> extractor_;
};

}  // namespace mono_pose_tracker
