#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

class ImagePreparer;

/// An image with what was found in it before its turn had come, while tracking did not know yet where the
/// object is in it. Tracker::prepare makes it; with the image alone all is done when its turn has come.
/// Neither changes a result.
struct PreparedImage {
  PreparedImage() = default;
  PreparedImage(const cv::Mat& image_alone) : image(image_alone) {}  // nothing is done ahead

  cv::Mat image;  // CV_8UC1 or CV_8UC3 (BGR)

  std::shared_ptr<const ImagePreparer> by;      // what follows is its work; none: there is nothing
  cv::Mat clearance;                            // where features may be, as far as could be guessed
  ImageFeaturesPtr features;                    // under this guess; none where guesses have been wrong
  std::shared_ptr<FeatureExtractor> extractor;  // that has prepared the image, where guesses have been wrong
  StageTimes stages;
};

}  // namespace mono_pose_tracker
