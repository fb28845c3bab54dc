#pragma once

#include <cstdint>
#include <vector>

#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {

/// Images (320x240) of a hand-held camera in a textured room, in metres.
struct SimulatedRoom {
  CameraModel camera;
  std::vector<SimulatedFrame> frames;
  std::vector<StampedPose> truth;
};

/// Another seed gives another room.
inline SimulatedRoom simulated_room(int frames, double noise_grey_levels, std::uint64_t seed = 1) {
  SequenceOptions options;
  options.scene = SceneKind::kRoom;
  options.frames = frames;
  options.camera = default_camera(SceneKind::kRoom, 320, 240);
  options.noise_grey_levels = noise_grey_levels;
  options.seed = seed;
  const SimulatedSequence sequence(options);
  SimulatedRoom room{sequence.camera(), {}, sequence.path()};
  for (int i = 0; i < sequence.size(); ++i) room.frames.push_back(sequence.render(i));
  return room;
}

}  // namespace mono_pose_tracker
