#pragma once

#include <memory>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Scenes with frames of their own at one moment, rendered together: a head and the shoulders below it.
class CompositeScene : public Scene {
 public:
  struct Part {
    std::shared_ptr<const Scene> scene;
    Rigid3 part_from_map;
    bool is_object;  // whether it may belong to the tracked object; its scene decides where
  };

  /// Parts have fewer than 1000 surfaces each.
  explicit CompositeScene(std::vector<Part> parts) : parts_(std::move(parts)) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map, const Lighting& lighting) const override;
  Color gloss(const Hit& hit, const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& to_camera,
              const Lighting& lighting) const override;
  bool is_object(const Hit& hit) const override;

 private:
  const Part& part_of(const Hit& hit) const;

  std::vector<Part> parts_;
};

}  // namespace mono_pose_tracker
