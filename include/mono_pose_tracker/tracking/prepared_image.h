#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

class ImagePreparer;

/// An image, and what was found in it ahead of its turn, when it was not known yet where in it the object is.
/// Tracker::prepare makes it. Made of the image alone, all is done in its turn, with the same result.
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
