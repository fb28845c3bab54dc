#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/motion_segmentation.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {

struct ObjectMasksOptions {
  std::size_t voters = 5;  // nearest tracks that vote, including the track itself: they outvote a single
                           // wrong match among the other object's features
  int min_features = 8;    // of the other object: fewer do not locate it
};

// Masks of the independent motion next to the mapped object, for every image of a recording: pixels nearer to
// its features than to those of the mapped object. Features move linearly between keyframes.
class ObjectMasks {
 public:
  // within: masks of which these are a part; null: none.
  ObjectMasks(const std::vector<MotionTrack>& tracks, std::shared_ptr<const ObjectMasks> within,
              const ObjectMasksOptions& options = {});

  bool are_empty() const { return spans_.empty(); }
  // Whether features were observed before and after the image, or in it.
  bool show(std::int64_t index) const;
  // Pixels of the mapped object and of the other one. index: of the image in the recording. Not for empty
  // masks.
  ObjectPoints at(std::int64_t index) const;
  // CV_8UC1, 255: the other object.
  cv::Mat mask(std::int64_t index, const cv::Size& size) const;

 private:
  std::map<std::int64_t, std::vector<MotionTrack>> spans_;  // by the first image of each span
  std::shared_ptr<const ObjectMasks> within_;
};

}  // namespace mono_pose_tracker
