#pragma once

namespace mono_pose_tracker {

/// How a head looks at one moment. As it stands here: at rest, its neck turning with it.
struct HeadLook {
  bool neck = true;         // false: the neck is not the head's, but bends (see torso_scene.h)
  float mouth_open = 0;     // m between the lips
  float lids = 0;           // 0 open to 1 closed
  float gaze = 0;           // m that the irises are off the middle, to the head's x
  bool loose_hair = false;  // fine strands, which sway with hair_time
  float hair_time = 0;      // s
  float shine = 0;          // strength of the light's reflection: 0.2 skin, 1 polished bronze
};

}  // namespace mono_pose_tracker
