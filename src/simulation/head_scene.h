#pragma once

#include <cstdint>

#include "simulation/head_look.h"
#include "simulation/scene.h"

namespace mono_pose_tracker {

/// A head (see head_shape.h), its own frame being the map: the camera moves against it.
class HeadScene : public Scene {
 public:
  explicit HeadScene(std::uint32_t seed, const HeadLook& look = {}) : seed_(seed), look_(look) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map, const Lighting& lighting) const override;
  Color gloss(const Hit& hit, const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& to_camera,
              const Lighting& lighting) const override;

 private:
  std::uint32_t seed_;
  HeadLook look_;
};

}  // namespace mono_pose_tracker
