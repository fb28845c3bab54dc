#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// A smooth wandering within [-1, 1]: a few sines of seeded phase and frequency.
class Wander {
 public:
  /// `slowest` and `fastest`: cycles per unit of the argument.
  Wander(double slowest, double fastest, Random* random) {
    for (int i = 0; i < kSines; ++i) {
      frequency_[i] = random->uniform(slowest, fastest);
      phase_[i] = random->uniform(0, 2 * M_PI);
    }
  }
  double operator()(double s) const {
    double sum = 0;
    for (int i = 0; i < kSines; ++i) sum += std::sin(2 * M_PI * frequency_[i] * s + phase_[i]);
    return sum / kSines;
  }

 private:
  static constexpr int kSines = 4;
  double frequency_[kSines];
  double phase_[kSines];
};

class Wander3 {
 public:
  Wander3(double slowest, double fastest, Random* random)
      : x_(slowest, fastest, random), y_(slowest, fastest, random), z_(slowest, fastest, random) {}
  Eigen::Vector3d operator()(double s) const { return {x_(s), y_(s), z_(s)}; }

 private:
  Wander x_, y_, z_;
};

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
