#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mono_pose_tracker {

/// Red, green, blue in [0, 1], as displayed (no gamma is applied later).
using Color = Eigen::Vector3f;

/// A half line in the map frame; direction of unit length.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// Where a ray meets a surface.
struct Hit {
  double distance = 0;                                      // m along the ray
  Eigen::Vector3d normal_in_map = Eigen::Vector3d::Zero();  // unit, towards the ray's origin
  int surface = -1;                                         // which of the scene's surfaces
};

/// One far key light over an even, slightly directed fill.
struct Lighting {
  Eigen::Vector3f key_direction_in_map;   // unit, towards the light
  Eigen::Vector3f fill_direction_in_map;  // unit, towards the brighter half of the surroundings
};

/// A world of textured surfaces that rays can be cast at. Map units are metres. Const: shared between
/// threads.
class Scene {
 public:
  virtual ~Scene() = default;

  /// The first surface the ray meets from `start` metres on; false when there is none. Exact to a micrometre.
  virtual bool intersect(const Ray& ray, double start, Hit* hit) const = 0;

  /// A distance within which no ray of a cone meets a surface: the cone of rays from the axis' origin within
  /// the angle with tangent `slope`. Infinite when none meets anything.
  virtual double free_distance(const Ray& /*axis*/, double /*slope*/) const { return 0; }

  /// Reflectance at a point of the surface that was hit, averaged over about `footprint` metres.
  virtual Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const = 0;

  /// Light arriving at a point of the surface.
  virtual Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map,
                           const Lighting& lighting) const = 0;

  /// Light that a shiny surface sends on as a mirror would, which is added; `to_camera`: unit.
  virtual Color gloss(const Hit& /*hit*/, const Eigen::Vector3d& /*x_in_map*/,
                      const Eigen::Vector3d& /*to_camera*/, const Lighting& /*lighting*/) const {
    return Color::Zero();
  }

  /// Whether the surface belongs to the tracked object and to its masks.
  virtual bool is_object(const Hit& /*hit*/) const { return true; }
};

}  // namespace mono_pose_tracker
