#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// Built-in paths: map_from_camera of each frame, smooth, the same for one seed. `frames` >= 1.

/// The camera against a head that turns before it as in the paper: frontal, to its right by 45 degrees, back
/// to frontal, down by 20 degrees, turning about the neck, with the slight sway of someone sitting.
/// `distance` is from the camera to the middle of the head, m.
std::vector<Rigid3> head_path(int frames, double distance, std::uint64_t seed);

/// The camera, still and looking 15 degrees down, against what turns once round before it but for 16 degrees,
/// about the upright axis of TurntableScene. `distance` is from the camera to that axis, m. The first frame's
/// map is the stage's frame: y down.
std::vector<Rigid3> turntable_path(int frames, double distance);

/// A hand-held camera in the room of make_room_scene: some 0.5 m of a curve to the right with a step forward,
/// looking at the far wall, with the jitter of a hand.
std::vector<Rigid3> handheld_room_path(int frames, std::uint64_t seed);

/// A closed, smooth lap in the same part of the room, some 2.3 m long, looking at the far wall: the frame
/// after the last is the first.
std::vector<Rigid3> room_lap(int frames);

/// As handheld_room_path before the plane of make_plane_scene, 2 m off.
std::vector<Rigid3> handheld_plane_path(int frames, std::uint64_t seed);

}  // namespace mono_pose_tracker
