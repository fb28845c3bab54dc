#pragma once

#include "map/tracking_map.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// The overlap of a registered frame with a keyframe.
struct Overlap {
  double parallax_deg = 0;  // median over the landmarks that the frame observes
  double in_view = 1;       // share of the keyframe's landmarks in view of the frame
};

Overlap overlap_with(const TrackingMap& map, KeyframeId id, const RegistrationReport& registration,
                     const CameraModel& camera);

struct KeyframePolicyOptions {
  double urgent_share = 0.5;  // of the limit in view, below which a keyframe is urgent: the view is about
                              // to leave the map, and waiting for the mapper would lose it
  double young_parallax_divisor = 3;  // a young map's points have little parallax: it needs more views early
  double least_parallax_share = 0.1;  // of the parallax that makes a keyframe due: with less, a new view of
                                      // lost landmarks adds nothing
};

// Decides when a registered frame becomes a keyframe.
class KeyframePolicy {
 public:
  // A map with at most young_map_keyframes keyframes is young.
  KeyframePolicy(const MappingOptions& options, int young_map_keyframes)
      : options_(options), young_map_keyframes_(young_map_keyframes) {}

  // Called once for each registered frame, with its number of inliers and the number of unfinished mapping
  // jobs.
  bool is_due(const TrackingMap& map, const Overlap& overlap, int inliers, int unfinished_jobs);

  void set_options(const MappingOptions& options, int young_map_keyframes) {
    options_ = options;
    young_map_keyframes_ = young_map_keyframes;
  }
  // Called when the map changes.
  void reset() { newest_keyframe_ = -1, most_inliers_ = 0; }

 private:
  MappingOptions options_;
  int young_map_keyframes_;
  KeyframeId newest_keyframe_ = -1;  // at the last frame
  int most_inliers_ = 0;             // over the frames since that keyframe
};

}  // namespace mono_pose_tracker
