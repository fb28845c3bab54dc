#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/motion_segmentation.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "pipeline/recording_result.h"
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
  ObjectMasks(const std::vector<MotionTrack>& tracks, std::shared_ptr<const ObjectMasks> within);

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

struct ObjectOutlinesOptions {
  std::size_t nearest_keyframes = 2;  // a single keyframe may be blurred; in more of them, landmarks at the
                                      // rim are no longer visible
};

/// Outlines of the object of a finished recording's first map in its images, from the landmarks of the
/// keyframes nearest to the image's viewpoint and from the independent motion.
class ObjectOutlines {
 public:
  /// The result must outlive this object.
  ObjectOutlines(const RecordingResult& result, const CameraModel& camera);

  /// Whether an independent motion was found next to the object in at least half of the images.
  bool have_other() const { return others_ != nullptr; }
  /// mask: the known mask of the object, CV_8UC1, 0: background; may be empty. Returns the part of the mask
  /// within the outline. Returns the outline alone where that part is less than half of it. Returns the mask
  /// itself where the frame has no pose or shows too little of the object.
  cv::Mat outlined(std::int64_t frame_index, const cv::Mat& image, const cv::Mat& mask) const;

 private:
  const Map& map_;
  CameraModel camera_;
  std::map<std::int64_t, Rigid3> camera_from_map_;  // by frame index
  std::shared_ptr<const ObjectMasks> others_;       // null: none
};

}  // namespace mono_pose_tracker
