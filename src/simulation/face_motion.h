#pragma once

#include <cstdint>

#include "simulation/head_look.h"

namespace mono_pose_tracker {

/// What of a face moves by itself.
struct FaceMotionOptions {
  bool speaks = false;  // about five syllables a second, with pauses
  bool blinks = false;  // every 1 to 2.5 s for a sixth of a second; the gaze jumps now and then
  bool loose_hair = false;
};

/// How the face is `time` seconds on. The same for one seed.
HeadLook face_look(const FaceMotionOptions& options, std::uint64_t seed, double time);

}  // namespace mono_pose_tracker
