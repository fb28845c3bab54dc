#include "mono_pose_tracker/common/random.h"
#include "mono_pose_tracker/simulation/panel_scene.h"

namespace mono_pose_tracker {
namespace {

enum RoomStyle { kWall, kFloor, kPicture, kWood, kCardboard, kCloth };

std::vector<LeafStyle> room_styles() {
  std::vector<LeafStyle> styles(6);
  LeafStyle& wall = styles[kWall];
  wall.base = Color(0.72f, 0.70f, 0.64f);
  wall.palette = {{0.80f, 0.78f, 0.72f}, {0.62f, 0.64f, 0.60f}, {0.70f, 0.62f, 0.52f}, {0.52f, 0.57f, 0.60f}};
  wall.density = 0.4f;
  wall.largest = 0.4f;
  wall.opacity = 0.6f;
  LeafStyle& floor = styles[kFloor];
  floor.base = Color(0.45f, 0.36f, 0.27f);
  floor.palette = {
      {0.60f, 0.48f, 0.34f}, {0.34f, 0.24f, 0.17f}, {0.66f, 0.60f, 0.48f}, {0.40f, 0.42f, 0.40f}};
  LeafStyle& picture = styles[kPicture];
  picture.base = Color(0.85f, 0.84f, 0.80f);
  picture.palette = {{0.75f, 0.25f, 0.20f}, {0.16f, 0.32f, 0.50f}, {0.90f, 0.72f, 0.28f},
                     {0.20f, 0.22f, 0.24f}, {0.30f, 0.52f, 0.36f}, {0.92f, 0.90f, 0.86f}};
  picture.largest = 0.2f;
  picture.smallest = 0.006f;
  picture.density = 0.65f;
  picture.opacity = 0.95f;
  LeafStyle& wood = styles[kWood];
  wood.base = Color(0.55f, 0.40f, 0.26f);
  wood.palette = {{0.66f, 0.50f, 0.34f}, {0.38f, 0.26f, 0.17f}, {0.74f, 0.62f, 0.46f}};
  wood.largest = 0.25f;
  wood.smallest = 0.006f;
  LeafStyle& cardboard = styles[kCardboard];
  cardboard.base = Color(0.64f, 0.52f, 0.38f);
  cardboard.palette = {
      {0.75f, 0.66f, 0.52f}, {0.30f, 0.26f, 0.22f}, {0.88f, 0.86f, 0.82f}, {0.58f, 0.30f, 0.22f}};
  cardboard.largest = 0.15f;
  cardboard.smallest = 0.006f;
  LeafStyle& cloth = styles[kCloth];
  cloth.base = Color(0.30f, 0.36f, 0.46f);
  cloth.palette = {
      {0.22f, 0.26f, 0.36f}, {0.46f, 0.52f, 0.60f}, {0.66f, 0.62f, 0.52f}, {0.50f, 0.26f, 0.26f}};
  cloth.largest = 0.2f;
  cloth.smallest = 0.006f;
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
    add(low, z, y, size.z(), size.y(), style);
    add(high, -x, z, size.x(), size.z(), style);
    add(high, z, -y, size.z(), size.y(), style);
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
  room.add_box({-1.7, 4.75, 0}, {1.1, 0.45, 1.0}, 0, kWood);
  room.add_box({-1.9, 4.75, 1.0}, {0.3, 0.25, 0.2}, 0.3, kPicture);
  room.add_box({-1.0, 3.0, 0}, {0.5, 0.5, 0.45}, 0.6, kCloth);
  room.add_box({2.2, 4.2, 0}, {0.7, 0.9, 1.3}, -0.1, kWood);
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
