#pragma once

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// How a posed frame relates to a keyframe.
struct Overlap {
  double parallax_deg = 0;  // median, of the landmarks that the frame sees
  double in_view = 1;       // share of the keyframe's landmarks that the frame could see
};

Overlap overlap_with(const TrackingMap& map, KeyframeId id, const RegistrationReport& registration,
                     const CameraModel& camera);

// When a posed frame is to become a keyframe.
class KeyframePolicy {
 public:
  // A map with no more keyframes than young_map_keyframes is young.
  KeyframePolicy(const MappingOptions& options, int young_map_keyframes)
      : options_(options), young_map_keyframes_(young_map_keyframes) {}

  // Asked once for each posed frame: with how many inliers, and how many of the mapper's jobs are not done.
  bool is_due(const TrackingMap& map, const Overlap& overlap, int inliers, int unfinished_jobs);

  void set_options(const MappingOptions& options, int young_map_keyframes) {
    options_ = options;
    young_map_keyframes_ = young_map_keyframes;
  }
  // Another map.
  void reset() { newest_keyframe_ = -1, most_inliers_ = 0; }

 private:
  MappingOptions options_;
  int young_map_keyframes_;
  KeyframeId newest_keyframe_ = -1;  // when the last frame came
  int most_inliers_ = 0;             // of the frames since that keyframe
};

}  // namespace mono_pose_tracker
