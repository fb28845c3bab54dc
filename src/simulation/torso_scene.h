#pragma once

#include <cstdint>

#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Shoulders in a shirt and the neck, at one moment. The torso's frame is that of the head at rest. The neck
/// is not rigid: it bends from the torso to the head, and its skin turns with the head in proportion to its
/// nearness.
class TorsoScene : public Scene {
 public:
  TorsoScene(std::uint32_t seed, const Rigid3& torso_from_head);

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_torso, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_torso,
                   const Lighting& lighting) const override;

 private:
  double distance(const Eigen::Vector3d& x) const;
  Eigen::Vector3d skin_place(const Eigen::Vector3d& x) const;

  std::uint32_t seed_;
  Rigid3 torso_from_head_;
  Eigen::Vector3d neck_top_;
};

}  // namespace mono_pose_tracker
