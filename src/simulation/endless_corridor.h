#pragma once

#include <cstdint>

#include "simulation/endless_room.h"
#include "simulation/wander.h"

namespace mono_pose_tracker {

/// A hand-held camera that walks along an endless corridor and looks obliquely at its right wall: nothing is
/// revisited, and a map grows without limit. Ray-cast, a few milliseconds per frame of 160x120. Const after
/// construction: may be shared between threads.
class EndlessCorridor {
 public:
  /// Of the options, lap_frames and threads mean nothing here. Throws std::invalid_argument naming what is
  /// wrong.
  explicit EndlessCorridor(const EndlessRoomOptions& options);

  /// Any frame from 0 on; the same for one seed whatever was asked for before. Metres.
  EndlessRoom::Frame frame(std::int64_t index) const;

 private:
  Rigid3 map_from_camera(double seconds) const;
  float grey(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const;

  EndlessRoomOptions options_;
  Wander3 sway_, turn_;
};

}  // namespace mono_pose_tracker
