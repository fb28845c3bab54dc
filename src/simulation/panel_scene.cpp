#include "simulation/panel_scene.h"

#include <limits>
#include <utility>

namespace mono_pose_tracker {

PanelScene::PanelScene(std::vector<Panel> panels, std::vector<LeafStyle> styles)
    : panels_(std::move(panels)), styles_(std::move(styles)) {
  normals_.reserve(panels_.size());
  for (const Panel& panel : panels_) normals_.push_back(panel.u_axis.cross(panel.v_axis));
}

bool PanelScene::intersect(const Ray& ray, double start, Hit* hit) const {
  double nearest = std::numeric_limits<double>::infinity();
  int found = -1;
  for (std::size_t i = 0; i < panels_.size(); ++i) {
    const double approach = normals_[i].dot(ray.direction);
    if (approach >= 0) continue;  // seen from behind
    const Panel& panel = panels_[i];
    const Eigen::Vector3d from_corner = ray.origin - panel.corner_in_map;
    const double distance = -normals_[i].dot(from_corner) / approach;
    if (distance < start || distance >= nearest) continue;
    const Eigen::Vector3d offset = from_corner + distance * ray.direction;
    const double u = panel.u_axis.dot(offset), v = panel.v_axis.dot(offset);
    if (u < 0 || u > panel.width || v < 0 || v > panel.height) continue;
    nearest = distance;
    found = static_cast<int>(i);
  }
  if (found < 0) return false;
  hit->distance = nearest;
  hit->normal_in_map = normals_[found];
  hit->surface = found;
  return true;
}

Color PanelScene::albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const {
  const Panel& panel = panels_[hit.surface];
  const Eigen::Vector3d offset = x_in_map - panel.corner_in_map;
  return leaf_texture(styles_[panel.style], panel.seed, static_cast<float>(panel.u_axis.dot(offset)),
                      static_cast<float>(panel.v_axis.dot(offset)), footprint);
}

Color PanelScene::irradiance(const Hit& hit, const Eigen::Vector3d&, const Lighting& lighting) const {
  const Eigen::Vector3f normal = hit.normal_in_map.cast<float>();
  const float key = std::max(0.f, normal.dot(lighting.key_direction_in_map));
  const float fill = 0.5f + 0.5f * normal.dot(lighting.fill_direction_in_map);
  return Color::Constant(0.55f + 0.35f * key + 0.25f * fill);
}

}  // namespace mono_pose_tracker
