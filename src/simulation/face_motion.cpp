#include "simulation/face_motion.h"

#include <cmath>

#include "common/rotation.h"
#include "simulation/noise.h"

namespace mono_pose_tracker {
namespace {

/// Syllables of 0.2 s open the mouth by up to 13 mm each; one in five is a pause.
float mouth_open(std::uint32_t seed, float time) {
  const int syllable = floor_int(time / 0.2f);
  const std::uint32_t h = hash_cell(seed, syllable, 0);
  if (unit_float(h) < 0.2f) return 0;
  const float s = time / 0.2f - static_cast<float>(syllable);
  return (0.004f + 0.009f * unit_float(rehash(h))) * std::pow(std::sin(static_cast<float>(kPi) * s), 2.f);
}

/// The first blink comes within the first second, the next 1 to 2.5 s after it, and so on.
float lids(std::uint32_t seed, float time) {
  constexpr float kBlink = 0.17f;  // s
  float start = 0.3f + 0.5f * unit_float(hash_cell(seed, 0, 0));
  for (int blink = 1; start + kBlink < time; ++blink)
    start += 1.f + 1.5f * unit_float(hash_cell(seed, blink, 0));
  const float s = (time - start) / kBlink;
  return s > 0 ? smooth_step(0.f, 0.35f, s) * smooth_step(1.f, 0.5f, s) : 0.f;
}

/// To a new place, up to 3 mm to the side, every 0.7 s.
float gaze(std::uint32_t seed, float time) {
  return 0.003f * (2.f * unit_float(hash_cell(seed, floor_int(time / 0.7f), 0)) - 1.f);
}

}  // namespace

HeadLook face_look(const FaceMotionOptions& options, std::uint64_t seed, double time) {
  const auto s = static_cast<std::uint32_t>(seed ^ (seed >> 32));
  const auto t = static_cast<float>(time);
  HeadLook look;
  if (options.speaks) look.mouth_open = mouth_open(s, t);
  if (options.blinks) look.lids = lids(s + 1, t);
  if (options.blinks) look.gaze = gaze(s + 2, t);
  look.loose_hair = options.loose_hair;
  look.hair_time = t;
  return look;
}

}  // namespace mono_pose_tracker
