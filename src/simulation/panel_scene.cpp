#include "simulation/panel_scene.h"

#include <limits>
#include <utility>

#include "common/statistics.h"

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

namespace {

enum RoomStyle { kWall, kFloor, kPicture, kWood, kCardboard, kCloth, kBooks, kRoomStyles };

const std::vector<Color> kBright = {{0.70f, 0.24f, 0.18f}, {0.16f, 0.32f, 0.50f}, {0.86f, 0.68f, 0.28f},
                                    {0.16f, 0.17f, 0.19f}, {0.28f, 0.46f, 0.32f}, {0.90f, 0.87f, 0.80f}};

std::vector<LeafStyle> room_styles() {
  std::vector<LeafStyle> styles(kRoomStyles);
  styles[kWall] =
      leaf_style({0.72f, 0.69f, 0.62f},
                 {{0.82f, 0.79f, 0.72f}, {0.58f, 0.58f, 0.52f}, {0.66f, 0.58f, 0.48f}, {0.50f, 0.54f, 0.55f}},
                 0.35f, 0.012f, 0.5f);
  styles[kFloor] =
      leaf_style({0.47f, 0.36f, 0.26f},
                 {{0.60f, 0.47f, 0.33f}, {0.32f, 0.23f, 0.16f}, {0.64f, 0.54f, 0.42f}, {0.40f, 0.32f, 0.24f}},
                 0.14f, 0.008f, 0.8f);
  styles[kFloor].upright = true;
  styles[kFloor].stretch_v = 4;
  styles[kPicture] = leaf_style({0.85f, 0.82f, 0.75f}, kBright, 0.25f, 0.008f, 0.95f);
  styles[kWood] =
      leaf_style({0.55f, 0.40f, 0.26f}, {{0.66f, 0.50f, 0.34f}, {0.36f, 0.25f, 0.16f}, {0.74f, 0.60f, 0.44f}},
                 0.12f, 0.006f, 0.7f);
  styles[kWood].stretch_u = 3;
  styles[kCardboard] =
      leaf_style({0.64f, 0.52f, 0.38f},
                 {{0.75f, 0.66f, 0.52f}, {0.30f, 0.26f, 0.22f}, {0.88f, 0.86f, 0.82f}, {0.58f, 0.30f, 0.22f}},
                 0.12f, 0.006f, 0.8f);
  styles[kCloth] =
      leaf_style({0.30f, 0.36f, 0.46f},
                 {{0.20f, 0.25f, 0.36f}, {0.46f, 0.52f, 0.60f}, {0.66f, 0.62f, 0.52f}, {0.52f, 0.27f, 0.26f}},
                 0.18f, 0.007f, 0.85f);
  styles[kBooks] = leaf_style({0.30f, 0.24f, 0.20f}, kBright, 0.06f, 0.008f, 0.95f);
  styles[kBooks].upright = true;
  styles[kBooks].stretch_v = 5;
  styles[kBooks].density = 0.95f;
  return styles;
}

class RoomBuilder {
 public:
  explicit RoomBuilder(std::uint32_t seed) : random_(seed) {}

  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& u_axis, const Eigen::Vector3d& v_axis,
           double width, double height, int style) {
    Panel panel;
    panel.corner_in_map = corner;
    panel.u_axis = u_axis;
    panel.v_axis = v_axis;
    panel.width = width;
    panel.height = height;
    panel.seed = static_cast<std::uint32_t>(random_.next());
    panel.style = style;
    panels_.push_back(panel);
  }

  /// A box seen from outside, standing at `base` (the middle of its bottom), turned by `yaw` radians about z.
  void add_box(const Eigen::Vector3d& base, const Eigen::Vector3d& size, double yaw, int style) {
    const Eigen::Vector3d x(std::cos(yaw), std::sin(yaw), 0), y(-x.y(), x.x(), 0), z(0, 0, 1);
    const Eigen::Vector3d low = base - 0.5 * size.x() * x - 0.5 * size.y() * y;
    const Eigen::Vector3d high = low + size.x() * x + size.y() * y;
    add(low, x, z, size.x(), size.z(), style);
    add(low + size.y() * y, -y, z, size.y(), size.z(), style);
    add(high, -x, z, size.x(), size.z(), style);
    add(low + size.x() * x, y, z, size.y(), size.z(), style);
    add(low + size.z() * z, x, y, size.x(), size.y(), style);
  }

  PanelScene finish() { return PanelScene(std::move(panels_), room_styles()); }

 private:
  Random random_;
  std::vector<Panel> panels_;
};

}  // namespace

PanelScene make_room_scene(std::uint32_t seed) {
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  RoomBuilder room(seed);
  room.add({-3, 5, 0}, x, z, 6, 2.6, kWall);
  room.add({-3, 0, 0}, y, z, 5, 2.6, kWall);
  room.add({3, 5, 0}, -y, z, 5, 2.6, kWall);
  room.add({3, 0, 0}, -x, z, 6, 2.6, kWall);
  room.add({-3, 0, 0}, x, y, 6, 5, kFloor);
  room.add({-3, 5, 2.6}, x, -y, 6, 5, kWall);
  room.add({-1.3, 4.99, 1.2}, x, z, 0.9, 0.65, kPicture);
  room.add({0.6, 4.99, 1.45}, x, z, 0.6, 0.8, kPicture);
  room.add({-2.99, 3.2, 1.1}, y, z, 1.0, 0.7, kPicture);
  room.add({2.99, 4.4, 1.2}, -y, z, 0.9, 0.6, kPicture);
  room.add({-0.6, 1.9, 0.005}, x, y, 1.6, 1.2, kCloth);
  room.add_box({0.3, 3.6, 0}, {1.4, 0.7, 0.74}, 0.12, kWood);
  room.add_box({0.0, 3.6, 0.74}, {0.35, 0.28, 0.26}, 0.5, kCardboard);
  room.add_box({0.65, 3.65, 0.74}, {0.3, 0.3, 0.42}, -0.3, kPicture);
  room.add_box({-1.7, 4.75, 0}, {1.1, 0.45, 1.0}, 0, kBooks);
  room.add_box({-1.9, 4.75, 1.0}, {0.3, 0.25, 0.2}, 0.3, kPicture);
  room.add_box({-1.0, 3.0, 0}, {0.5, 0.5, 0.45}, 0.6, kCloth);
  room.add_box({2.2, 4.2, 0}, {0.7, 0.9, 1.3}, -0.1, kBooks);
  room.add_box({1.5, 2.7, 0}, {0.45, 0.4, 0.55}, -0.5, kCardboard);
  return room.finish();
}

PanelScene make_plane_scene(std::uint32_t seed) {
  Panel panel;
  panel.corner_in_map = Eigen::Vector3d(-3, 0, -2.5);
  panel.u_axis = Eigen::Vector3d::UnitX();
  panel.v_axis = Eigen::Vector3d::UnitZ();
  panel.width = 6;
  panel.height = 5;
  panel.seed = seed;
  panel.style = kPicture;
  std::vector<LeafStyle> styles = room_styles();
  styles[kPicture].largest = 0.6f;
  return PanelScene({panel}, std::move(styles));
}

}  // namespace mono_pose_tracker
