#include "simulation/noise.h"

namespace mono_pose_tracker {
namespace {

float lattice_value(std::uint32_t seed, int x, int y, int z = 0) {
  return 2.f * unit_float(hash_cell(seed, x, y, z)) - 1.f;
}

float fade(float t) { return t * t * (3.f - 2.f * t); }

float mix(float a, float b, float t) { return a + (b - a) * t; }

/// How much of an octave a sample of this size still resolves: all of it at four samples a period, none at
/// two.
float octave_weight(float period, float footprint) { return smooth_step(2.f, 4.f, period / footprint); }

template <class Noise>
float sum_octaves(std::uint32_t seed, float period, int octaves, float footprint, const Noise& noise) {
  float sum = 0, amplitude = 1;
  for (int i = 0; i < octaves; ++i, period *= 0.5f, amplitude *= 0.5f) {
    const float weight = octave_weight(period, footprint);
    if (weight <= 0) break;
    sum += weight * amplitude * noise(seed + 101u * i, 1.f / period);
  }
  return sum;
}

}  // namespace

float value_noise(std::uint32_t seed, float x, float y) {
  const int ix = floor_int(x), iy = floor_int(y);
  const float tx = fade(x - ix), ty = fade(y - iy);
  const float low = mix(lattice_value(seed, ix, iy), lattice_value(seed, ix + 1, iy), tx);
  const float high = mix(lattice_value(seed, ix, iy + 1), lattice_value(seed, ix + 1, iy + 1), tx);
  return mix(low, high, ty);
}

float value_noise(std::uint32_t seed, float x, float y, float z) {
  const int ix = floor_int(x), iy = floor_int(y), iz = floor_int(z);
  const float tx = fade(x - ix), ty = fade(y - iy), tz = fade(z - iz);
  float slice[2];
  for (int k = 0; k < 2; ++k) {
    const float low = mix(lattice_value(seed, ix, iy, iz + k), lattice_value(seed, ix + 1, iy, iz + k), tx);
    const float high =
        mix(lattice_value(seed, ix, iy + 1, iz + k), lattice_value(seed, ix + 1, iy + 1, iz + k), tx);
    slice[k] = mix(low, high, ty);
  }
  return mix(slice[0], slice[1], tz);
}

float fractal_noise(std::uint32_t seed, float x, float y, float period, int octaves, float footprint) {
  return sum_octaves(seed, period, octaves, footprint, [&](std::uint32_t octave_seed, float frequency) {
    return value_noise(octave_seed, x * frequency, y * frequency);
  });
}

float fractal_noise(std::uint32_t seed, float x, float y, float z, float period, int octaves,
                    float footprint) {
  return sum_octaves(seed, period, octaves, footprint, [&](std::uint32_t octave_seed, float frequency) {
    return value_noise(octave_seed, x * frequency, y * frequency, z * frequency);
  });
}

}  // namespace mono_pose_tracker
