#pragma once

#include <cstdint>

#include "simulation/scene.h"

namespace mono_pose_tracker {

/// The top of a turntable, and the plinth below it, which does not turn. Its frame is that of the head that
/// stands on it.
class TurntableScene : public Scene {
 public:
  explicit TurntableScene(std::uint32_t seed) : seed_(seed) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x, const Lighting& lighting) const override;
  bool is_object(const Hit& hit) const override;

 private:
  std::uint32_t seed_;
};

}  // namespace mono_pose_tracker
