#pragma once

#include <cstdint>
#include <vector>

#include "simulation/scene.h"

namespace mono_pose_tracker {

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
