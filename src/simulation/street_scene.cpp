#include "street_scene.h"

#include <algorithm>
#include <cmath>

#include "common/random.h"
#include "common/rotation.h"
#include "simulation/wander.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kEyeLevel = 1.6;  // m
constexpr double kStep = 0.25;     // m from one frame to the next
constexpr double kHouse = 8;       // m, width of a front

enum StreetStyle { kFront, kGround, kPlaster, kDoor, kStreetStyles };

std::vector<LeafStyle> street_styles() {
  std::vector<LeafStyle> styles(kStreetStyles);
  const std::vector<Color> bright = {{0.70f, 0.30f, 0.22f}, {0.24f, 0.34f, 0.46f}, {0.84f, 0.72f, 0.44f},
                                     {0.18f, 0.18f, 0.20f}, {0.34f, 0.46f, 0.34f}, {0.90f, 0.88f, 0.82f}};
  styles[kFront] = leaf_style({0.66f, 0.60f, 0.52f}, bright, 1.2f, 0.03f, 0.9f);
  styles[kFront].upright = true;
  styles[kGround] =
      leaf_style({0.40f, 0.39f, 0.38f}, {{0.50f, 0.49f, 0.47f}, {0.28f, 0.28f, 0.29f}}, 0.5f, 0.03f, 0.7f);
  // Weak: what tells one stretch of a corridor from another is little.
  styles[kPlaster] =
      leaf_style({0.74f, 0.73f, 0.70f}, {{0.68f, 0.67f, 0.63f}, {0.79f, 0.78f, 0.75f}}, 0.4f, 0.02f, 0.6f);
  styles[kDoor] = leaf_style({0.52f, 0.38f, 0.26f}, bright, 0.3f, 0.02f, 0.9f);
  styles[kDoor].upright = true;
  return styles;
}

class StreetBuilder {
 public:
  explicit StreetBuilder(std::uint32_t seed) : random_(seed) {}

  // Seen from the right of from -> to.
  void add_wall(const PlanWall& wall, double first, double width, double low, double high, int style,
                double before, std::uint32_t seed) {
    const Vector2d along = (wall.to - wall.from).normalized();
    const Vector2d corner = wall.from + first * along + before * Vector2d(along.y(), -along.x());
    add({{corner.x(), corner.y(), low},
         {along.x(), along.y(), 0},
         Vector3d::UnitZ(),
         width,
         high - low,
         seed,
         style});
  }

  void add_fronts(const PlanWall& wall, double height, int style) {
    const double length = (wall.to - wall.from).norm();
    for (int house = 0; house * kHouse < length - 1e-9; ++house) {
      const double first = house * kHouse;
      add_wall(wall, first, std::min(kHouse, length - first), 0, height, style, 0, next_seed());
    }
  }

  // The first panel is the ground, as large as all walls.
  void add_ground(const std::vector<PlanWall>& walls) {
    Vector2d low = walls.front().from, high = low;
    for (const PlanWall& wall : walls) {
      low = low.cwiseMin(wall.from).cwiseMin(wall.to);
      high = high.cwiseMax(wall.from).cwiseMax(wall.to);
    }
    add({{low.x(), low.y(), 0},
         Vector3d::UnitX(),
         Vector3d::UnitY(),
         high.x() - low.x(),
         high.y() - low.y(),
         next_seed(),
         kGround});
  }

  std::uint32_t next_seed() { return static_cast<std::uint32_t>(random_.next()); }
  PanelScene finish() { return PanelScene(std::move(panels_), street_styles()); }

 private:
  void add(const Panel& panel) { panels_.push_back(panel); }

  Random random_;
  std::vector<Panel> panels_;
};

}  // namespace

PanelScene make_street_scene(const StreetPlan& plan, std::uint32_t seed) {
  constexpr double kHouseHeight = 6, kCorridorHeight = 2.6;
  const bool corridor = !plan.door_walls.empty();
  StreetBuilder builder(seed);
  builder.add_ground(plan.walls());
  for (const PlanWall& wall : plan.walls()) {
    builder.add_fronts(wall, corridor ? kCorridorHeight : kHouseHeight, corridor ? kPlaster : kFront);
  }
  const std::uint32_t door_seed = builder.next_seed();
  for (const PlanWall& wall : plan.door_walls) {
    const double length = (wall.to - wall.from).norm();
    for (double first = 0.5; first + 1 < length; first += plan.door_spacing) {
      builder.add_wall(wall, first, 1, 0, 2.1, kDoor, 0.02, door_seed);
    }
  }
  return builder.finish();
}

std::vector<Rigid3> street_path(const StreetPlan& plan, int frames, std::uint64_t seed) {
  double step = kStep;
  if (frames > 0) step = length_of(rounded_way(plan, kStep)) / std::max(frames - 1, 1);
  std::vector<Waypoint> way = rounded_way(plan, step);
  if (frames > 0 && static_cast<int>(way.size()) > frames) way.resize(frames);
  Random random(seed);
  const Wander3 sway(20, 40, &random), turn(20, 40, &random);
  std::vector<Rigid3> path;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double done = static_cast<double>(i) / static_cast<double>(way.size());
    const Vector3d glance = 1.5 * kDegree * turn(done);
    const Vector3d position = Vector3d(way[i].at.x(), way[i].at.y(), kEyeLevel) + 0.05 * sway(done);
    const double heading = way[i].heading + plan.aside_deg * kDegree + glance.z();
    Eigen::Matrix3d map_from_camera;
    map_from_camera.col(2) = Vector3d(std::sin(heading), std::cos(heading), glance.x()).normalized();
    map_from_camera.col(0) = map_from_camera.col(2).cross(Vector3d::UnitZ()).normalized();
    map_from_camera.col(1) = map_from_camera.col(2).cross(map_from_camera.col(0));
    path.emplace_back(map_from_camera, position);
  }
  return path;
}

}  // namespace mono_pose_tracker
