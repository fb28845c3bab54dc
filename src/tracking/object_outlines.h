#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>

#include "mono_pose_tracker/camera/camera_model.h"
#include "tracking/recording.h"

namespace mono_pose_tracker {

/// Outlines of what the first map of a finished recording is of, in its images: by the landmarks of the two
/// keyframes that are nearest to where an image was taken from, and by what was seen to move otherwise.
class ObjectOutlines {
 public:
  /// The result must stay.
  ObjectOutlines(const RecordingResult& result, const CameraModel& camera);

  /// Whether something was seen to move otherwise than the map says, beside half of the images at least.
  bool have_other() const { return others_ != nullptr; }
  /// mask: what is known of where the body is, CV_8UC1, 0: not of it; may be empty. What of it lies within
  /// the outline; the outline alone where that is less than half of it; the mask itself where the frame has
  /// no pose or shows too little of the body.
  cv::Mat outlined(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& mask) const;

 private:
  const Map& map_;
  CameraModel camera_;
  std::map<std::int64_t, Rigid3> camera_from_map_;  // by frame index
  std::shared_ptr<const ObjectMasks> others_;       // null: none
};

}  // namespace mono_pose_tracker
