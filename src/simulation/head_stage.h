#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/camera_path.h"
#include "simulation/panel_scene.h"
#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {

/// Where head, shoulders, turntable, room and camera are. The stage's frame is the head's when the head is at
/// rest; `rest` is the camera's frame when nobody's hand moves it. `done` is the share of the sequence that
/// has passed.
class HeadStage {
 public:
  HeadStage(const SequenceOptions& options, std::uint32_t texture_seed, std::uint64_t motion_seed);

  /// map_from_camera of each frame of the built-in motion.
  std::vector<Rigid3> path(int frames, std::uint64_t seed) const;
  Rigid3 rest_from_camera(double done) const;
  Rigid3 room_from_camera(double done) const;
  const PanelScene& room() const { return room_; }

  /// What stands on the stage, seen in the map's frame, `time` seconds on.
  std::shared_ptr<const Scene> scene(const Rigid3& map_from_camera, double done, double time) const;

 private:
  Rigid3 stage_from_rest() const;
  Rigid3 stage_from_torso(double done) const;

  SequenceOptions options_;
  std::uint32_t texture_seed_;
  std::uint64_t motion_seed_;
  PanelScene room_;
  Wander3 torso_sway_, torso_tilt_, hand_sway_, hand_shake_, hand_turn_;
};

}  // namespace mono_pose_tracker
