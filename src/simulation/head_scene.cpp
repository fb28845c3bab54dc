#include "simulation/head_scene.h"

#include "simulation/head_shape.h"
#include "simulation/ray_march.h"
#include "simulation/skin_light.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

const Ball kHeadBall{head_bound_centre(), kHeadBoundRadius};

}  // namespace

bool HeadScene::intersect(const Ray& ray, double start, Hit* hit) const {
  const auto field = [this](const Vector3d& x) { return head_distance(x, look_.neck); };
  if (!intersect_field(field, kHeadBall, ray, start, hit)) return false;
  hit->surface = 0;
  return true;
}

double HeadScene::free_distance(const Ray& axis, double slope) const {
  return march_cone([this](const Vector3d& x) { return head_distance(x, look_.neck); }, kHeadBall, axis,
                    slope);
}

Color HeadScene::albedo(const Hit&, const Vector3d& x_in_map, float footprint) const {
  return head_albedo(seed_, look_, x_in_map.cast<float>(), footprint);
}

Color HeadScene::irradiance(const Hit& hit, const Vector3d& x_in_map, const Lighting& lighting) const {
  // Hollows see less of the surroundings: the free distance a finger's breadth off the surface tells how
  // much.
  constexpr double kBreadth = 0.015;
  const double free = head_distance(x_in_map + kBreadth * hit.normal_in_map, look_.neck) / kBreadth;
  return skin_light(hit.normal_in_map.cast<float>(), free, lighting);
}

Color HeadScene::gloss(const Hit& hit, const Vector3d& x_in_map, const Vector3d& to_camera,
                       const Lighting& lighting) const {
  if (look_.shine <= 0) return Color::Zero();
  return look_.shine *
         reflected_light(uneven_normal(seed_ + 30, x_in_map, hit.normal_in_map), to_camera, lighting);
}

}  // namespace mono_pose_tracker
