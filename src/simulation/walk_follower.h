#pragma once

#include "mapping/initial_map.h"
#include "mapping/mapper.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/feature_walk.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// CPU time of this thread.
double thread_seconds();

// Follows a walk frame by frame: each frame is registered in the present map (predicted by the last motion)
// and becomes a keyframe.
class WalkFollower {
 public:
  WalkFollower(const TrackerOptions& options, const CameraModel& camera);

  Mapper& mapper() { return mapper_; }
  double worst_prediction() const { return worst_prediction_; }
  double insert_seconds() const { return insert_seconds_; }  // of the last keyframe

  void begin(const InitialMap& initial);
  // False when the frame was not registered.
  bool follow(const Frame& frame);
  void close_loops();

 private:
  FrameRegistrar registrar_;
  Mapper mapper_;
  KeyframeId reference_ = -1;
  Rigid3 motion_;  // camera now from camera one frame ago
  double worst_prediction_ = 0;
  double insert_seconds_ = 0;
};

}  // namespace mono_pose_tracker
