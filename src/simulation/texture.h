#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Integer hash of a lattice cell: the same on every machine, no state (finaliser of MurmurHash3, Appleby).
inline std::uint32_t hash_cell(std::uint32_t seed, int x, int y, int z = 0) {
  std::uint32_t h = seed * 0x9e3779b1u;
  h ^= static_cast<std::uint32_t>(x) * 0x8da6b343u;
  h ^= static_cast<std::uint32_t>(y) * 0xd8163841u;
  h ^= static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

/// A further hash from a hash: several independent numbers of one cell.
inline std::uint32_t rehash(std::uint32_t h) { return hash_cell(h, 0x51ed, 0x2d2b); }

/// Uniform in [0, 1) from the upper 24 bits of a hash.
inline float unit_float(std::uint32_t h) { return static_cast<float>(h >> 8) * 0x1.0p-24f; }

/// floor, as an int: std::floor is a library call where the processor's rounding instruction is not assumed.
inline int floor_int(float x) {
  const int i = static_cast<int>(x);
  return i - (static_cast<float>(i) > x);
}

/// 0 below a, 1 above b, smooth between.
inline float smooth_step(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.f, 1.f);
  return t * t * (3.f - 2.f * t);
}

/// Value noise of lattice period 1, in [-1, 1], smooth.
float value_noise(std::uint32_t seed, float x, float y);
float value_noise(std::uint32_t seed, float x, float y, float z);

/// Octaves of value noise, each half the period and half the amplitude of the one before, the first of the
/// given period and amplitude 1. Octaves finer than twice `footprint` (the size of a sample, same unit) fade
/// out: no aliasing.
float fractal_noise(std::uint32_t seed, float x, float y, float period, int octaves, float footprint);
float fractal_noise(std::uint32_t seed, float x, float y, float z, float period, int octaves,
                    float footprint);

/// Style of a surface covered with flat shapes of all sizes, the large below the small: the "dead leaves"
/// model with the statistics of natural images (Lee, Mumford, Huang 2001). The texture does not repeat.
struct LeafStyle {
  Color base = Color(0.6f, 0.6f, 0.6f);
  std::vector<Color> palette;  // the shapes' colours; not empty
  float largest = 0.5f;        // m, cell size of the coarsest layer
  float smallest = 0.01f;      // m, of the finest
  float density = 0.7f;        // share of the coarsest layer's cells that hold a shape
  float decay = 0.35f;         // density of a layer goes with its cell size to this power
  float opacity = 0.7f;        // greatest opacity of a shape
  float stretch_u = 1;         // shapes are so many times longer along u: the grain of wood
  float stretch_v = 1;         // and along v
  bool upright = false;        // only rectangles with sides along u and v
  float grain = 0.08f;         // amplitude of the noise over everything
};

/// What scenes choose of a style; the rest is as it stands above.
LeafStyle leaf_style(const Color& base, const std::vector<Color>& palette, float largest, float smallest,
                     float opacity);

/// Colour at (u, v) metres of the surface, averaged over about `footprint` metres.
Color leaf_texture(const LeafStyle& style, std::uint32_t seed, float u, float v, float footprint);

}  // namespace mono_pose_tracker
