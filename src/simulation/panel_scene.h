#pragma once

#include <cstdint>
#include <vector>

#include "simulation/scene.h"
#include "simulation/texture.h"

namespace mono_pose_tracker {

/// A flat textured rectangle. A point of it: corner + u * u_axis + v * v_axis, u in [0, width], v in [0,
/// height]. Seen only from the side its normal u_axis x v_axis points to.
struct Panel {
  Eigen::Vector3d corner_in_map;
  Eigen::Vector3d u_axis, v_axis;  // unit, at right angles
  double width = 1, height = 1;    // m
  std::uint32_t seed = 0;          // of its texture
  int style = 0;                   // index into the scene's styles
};

/// A scene of panels: a room, or one plane.
class PanelScene : public Scene {
 public:
  PanelScene(std::vector<Panel> panels, std::vector<LeafStyle> styles);

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map, const Lighting& lighting) const override;

  const std::vector<Panel>& panels() const { return panels_; }

 private:
  std::vector<Panel> panels_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<LeafStyle> styles_;
};

/// A room of 6 by 5 m, 2.6 m high, z up, with furniture along its far wall (y = 5) and pictures on the walls.
/// The path of handheld_room_path looks at it from about the middle.
PanelScene make_room_scene(std::uint32_t seed);

/// One plane (y = 0) of 6 by 5 m about the origin, z up, seen from negative y.
PanelScene make_plane_scene(std::uint32_t seed);

}  // namespace mono_pose_tracker
