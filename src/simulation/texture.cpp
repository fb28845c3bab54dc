#include "simulation/texture.h"

#include <algorithm>
#include <cmath>

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

namespace {

/// Each layer's cells over those of the layer before: sizes close enough for detail at every scale.
constexpr float kLayerRatio = 0.55f;

/// Shapes reach at most this many cells from their centre, which lies in [0.3, 0.7] of the cell: so a place
/// is touched by the shapes of the nearest 2 x 2 cells only.
constexpr float kLargestRadius = 0.8f;

/// One layer as seen by one sample; lengths in cells.
struct Layer {
  float density, softness, weight;
};

/// Signed distance, in cells, from the edge of the cell's shape: a disc, a ring, a rectangle or a triangle.
float shape_distance(std::uint32_t h, float x, float y, float radius, bool upright) {
  const std::uint32_t kind = h & 15u;
  const float half = radius * (0.25f + 0.5f * unit_float(h * 0x9e3779b1u));
  if (upright) return std::max(std::fabs(x) - half, std::fabs(y) - 0.66f * radius);
  if (kind < 4) return std::sqrt(x * x + y * y) - radius;
  if (kind == 4) return std::fabs(std::sqrt(x * x + y * y) - 0.75f * radius) - 0.2f * radius;
  const float angle = 6.2831853f * unit_float(rehash(h));
  const float c = std::cos(angle), s = std::sin(angle);
  const float px = c * x + s * y, py = c * y - s * x;
  if (kind < 12)
    return std::max(std::fabs(px) - 0.8f * radius, std::fabs(py) - std::min(half, 0.58f * radius));
  return std::max(std::max(0.866f * px + 0.5f * py, -0.866f * px + 0.5f * py), -py) - 0.48f * radius;
}

void blend_cell(const LeafStyle& style, const Layer& layer, std::uint32_t h, float x, float y, Color* color) {
  if (unit_float(h) > layer.density) return;
  const std::uint32_t h1 = rehash(h), h2 = rehash(h1);
  x -= 0.3f + 0.4f * unit_float(h1);
  y -= 0.3f + 0.4f * unit_float(h2);
  const float radius = kLargestRadius * (0.35f + 0.65f * unit_float(h * 0x85ebca6bu));
  const float reach = radius + layer.softness;
  if (x * x + y * y > reach * reach) return;
  const float distance = shape_distance(rehash(h2), x, y, radius, style.upright);
  const float coverage = smooth_step(layer.softness, -layer.softness, distance);
  const std::size_t index = static_cast<std::size_t>(h1 & 0xffu) * style.palette.size() >> 8;
  const float shade = 0.8f + 0.4f * unit_float(h2 * 0x85ebca6bu);
  const float opacity = style.opacity * (0.4f + 0.6f * unit_float(h1 * 0x9e3779b1u));
  *color += layer.weight * opacity * coverage * (shade * style.palette[index] - *color);
}

}  // namespace

LeafStyle leaf_style(const Color& base, const std::vector<Color>& palette, float largest, float smallest,
                     float opacity) {
  LeafStyle style;
  style.base = base;
  style.palette = palette;
  style.largest = largest;
  style.smallest = smallest;
  style.opacity = opacity;
  return style;
}

Color leaf_texture(const LeafStyle& style, std::uint32_t seed, float u, float v, float footprint) {
  Color color = style.base * (1.f + 0.15f * value_noise(seed, 2.f * u, 2.f * v));
  const float decay_ratio = std::pow(kLayerRatio, style.decay);
  const float stretched_u = u / style.stretch_u, stretched_v = v / style.stretch_v;
  std::uint32_t layer_seed = seed;
  Layer layer{style.density, 0, 0};
  float cell = style.largest;
  while (cell >= style.smallest) {
    layer_seed = rehash(layer_seed);
    // Shapes of a layer are about a cell across: they fade as the cell nears two samples.
    layer.weight = smooth_step(1.5f, 3.f, cell / footprint);
    if (layer.weight <= 0) break;
    layer.softness = 0.6f * footprint / cell;
    const float x = stretched_u / cell, y = stretched_v / cell;
    const int x0 = floor_int(x - 0.5f), y0 = floor_int(y - 0.5f);
    for (int j = y0; j <= y0 + 1; ++j) {
      for (int i = x0; i <= x0 + 1; ++i)
        blend_cell(style, layer, hash_cell(layer_seed, i, j), x - i, y - j, &color);
    }
    cell *= kLayerRatio;
    layer.density *= decay_ratio;
  }
  if (style.grain > 0) {
    color *= 1.f + style.grain *
                       fractal_noise(seed + 7u, stretched_u, stretched_v, 4 * style.smallest, 3, footprint);
  }
  return color;
}

}  // namespace mono_pose_tracker
