#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <vector>

#include "mono_pose_tracker/mapping/other_body.h"
#include "mono_pose_tracker/segmentation/body_points.h"

namespace mono_pose_tracker {

// Masks of what moves otherwise than the body that a finished map is of, for every image of the recording:
// what lies nearer to its features than to the map's. Between keyframes features go straight on.
class BodyMasks {
 public:
  // within: masks that these are a part of; null: none.
  BodyMasks(const std::vector<BodyTrack>& tracks, std::shared_ptr<const BodyMasks> within);

  bool are_empty() const { return spans_.empty(); }
  // Whether features were seen before and after the image, or in it.
  bool show(std::int64_t index) const;
  // The same the other way round: of the map's body.
  std::shared_ptr<const BodyMasks> reversed() const;
  // The same for these images of the recording; for all others those beside.
  std::shared_ptr<const BodyMasks> only_in(std::set<std::int64_t> indices,
                                           std::shared_ptr<const BodyMasks> beside) const;
  // The map's body, and the other. index: of the image in the recording. Not when they are empty.
  BodyPoints at(std::int64_t index) const;
  // CV_8UC1, 255: of the other body.
  cv::Mat mask(std::int64_t index, const cv::Size& size) const;

 private:
  std::map<std::int64_t, std::vector<BodyTrack>> spans_;  // by the image that each begins with
  std::shared_ptr<const BodyMasks> within_;
  std::shared_ptr<const BodyMasks> beside_;  // null: these are of every image
  std::set<std::int64_t> only_in_;           // images, where there are masks beside
};

}  // namespace mono_pose_tracker
