#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/independent_motion.h"
#include "segmentation/object_points.h"

namespace mono_pose_tracker {

// Masks of what moves otherwise than the body that a finished map is of, for every image of the recording:
// what lies nearer to its features than to the map's. Between keyframes features go straight on.
class ObjectMasks {
 public:
  // within: masks that these are a part of; null: none.
  ObjectMasks(const std::vector<MotionTrack>& tracks, std::shared_ptr<const ObjectMasks> within);

  bool are_empty() const { return spans_.empty(); }
  // Whether features were seen before and after the image, or in it.
  bool show(std::int64_t index) const;
  // The map's body, and the other. index: of the image in the recording. Not when they are empty.
  ObjectPoints at(std::int64_t index) const;
  // CV_8UC1, 255: of the other body.
  cv::Mat mask(std::int64_t index, const cv::Size& size) const;

 private:
  std::map<std::int64_t, std::vector<MotionTrack>> spans_;  // by the image that each begins with
  std::shared_ptr<const ObjectMasks> within_;
};

}  // namespace mono_pose_tracker
