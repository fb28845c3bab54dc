#include "simulation/composite_scene.h"

#include <algorithm>
#include <limits>

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

constexpr int kSurfaces = 1000;  // of a part: its numbers are part * kSurfaces + its own

Ray in_part(const Rigid3& part_from_map, const Ray& ray) {
  return {part_from_map * ray.origin, part_from_map.rotation * ray.direction};
}

Hit in_part(const Rigid3& part_from_map, const Hit& hit) {
  return {hit.distance, part_from_map.rotation * hit.normal_in_map, hit.surface % kSurfaces};
}

Lighting in_part(const Rigid3& part_from_map, const Lighting& lighting) {
  const Eigen::Quaternionf rotation = part_from_map.rotation.cast<float>();
  return {rotation * lighting.key_direction_in_map, rotation * lighting.fill_direction_in_map};
}

}  // namespace

const CompositeScene::Part& CompositeScene::part_of(const Hit& hit) const {
  return parts_[hit.surface / kSurfaces];
}

bool CompositeScene::intersect(const Ray& ray, double start, Hit* hit) const {
  hit->distance = std::numeric_limits<double>::infinity();
  bool found = false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Rigid3& part_from_map = parts_[i].part_from_map;
    Hit own;
    if (!parts_[i].scene->intersect(in_part(part_from_map, ray), start, &own)) continue;
    if (own.distance >= hit->distance) continue;
    *hit = {own.distance, part_from_map.rotation.conjugate() * own.normal_in_map,
            static_cast<int>(i) * kSurfaces + own.surface};
    found = true;
  }
  return found;
}

double CompositeScene::free_distance(const Ray& axis, double slope) const {
  double free = std::numeric_limits<double>::infinity();
  for (const Part& part : parts_) {
    free = std::min(free, part.scene->free_distance(in_part(part.part_from_map, axis), slope));
  }
  return free;
}

Color CompositeScene::albedo(const Hit& hit, const Vector3d& x_in_map, float footprint) const {
  const Part& part = part_of(hit);
  return part.scene->albedo(in_part(part.part_from_map, hit), part.part_from_map * x_in_map, footprint);
}

Color CompositeScene::irradiance(const Hit& hit, const Vector3d& x_in_map, const Lighting& lighting) const {
  const Part& part = part_of(hit);
  return part.scene->irradiance(in_part(part.part_from_map, hit), part.part_from_map * x_in_map,
                                in_part(part.part_from_map, lighting));
}

Color CompositeScene::gloss(const Hit& hit, const Vector3d& x_in_map, const Vector3d& to_camera,
                            const Lighting& lighting) const {
  const Part& part = part_of(hit);
  return part.scene->gloss(in_part(part.part_from_map, hit), part.part_from_map * x_in_map,
                           part.part_from_map.rotation * to_camera, in_part(part.part_from_map, lighting));
}

bool CompositeScene::is_object(const Hit& hit) const {
  const Part& part = part_of(hit);
  return part.is_object && part.scene->is_object(in_part(part.part_from_map, hit));
}

}  // namespace mono_pose_tracker
